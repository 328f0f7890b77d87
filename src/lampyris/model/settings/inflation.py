"""Settings of inflation: costs of the cells near walls."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.settings import check_settings, number, under_name


@dataclass(frozen=True, slots=True)
class Inflation:
    """Costs of the cells near walls, as Nav2's inflation layer has them.

    Parameters
    ----------
    inflation_radius : cells within this distance of a wall cost more, and more the closer they are. 0: none do.
    cost_scaling_factor : how fast that cost falls with the distance; a larger factor lets the robot drive closer to
        walls.

    Raises
    ------
    SettingError : ``INFLATION_RADIUS``, ``COST_SCALING_FACTOR``.
    """

    inflation_radius: float = number(0.0, 0.0, 1e3, unit="m")
    cost_scaling_factor: float = number(10.0, 0.0, 1e6, unit="1/m")

    def __post_init__(self) -> None:
        check_settings(self, under_name("inflation"))
