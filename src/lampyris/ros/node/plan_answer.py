"""The answer to a request for a path."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris.ros.node.route import Route
from lampyris.typing import Floats


@dataclass(frozen=True)
class PlanAnswer:
    """The answer to a request for a path.

    Parameters
    ----------
    poses : float64 (n, 3): x, y, yaw in the map frame; None: there is no path.
    error : the name of Nav2's error code; empty: none.
    detail : a sentence.
    route : for the follower.
    """

    poses: Floats | None
    error: str = ""
    detail: str = ""
    route: Route | None = None
