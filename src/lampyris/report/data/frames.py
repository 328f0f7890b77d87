"""Nouns as pandas data frames: what ``to_pandas`` of plans, profiles, traces and drives returns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lampyris.errors import UsageError
from lampyris.model.drive import Drive
from lampyris.model.grid import MapFrame
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.trace import Trace
from lampyris.report.data.columns import Columns, drive_columns, plan_columns, profile_columns, trace_columns

if TYPE_CHECKING:
    import pandas


def frame_of(noun: object, *, frame: MapFrame | None = None) -> pandas.DataFrame:
    """A plan, profile, trace or drive as a table.

    Parameters
    ----------
    frame : where the cells of a plan or profile lie; traces and drives know it.

    Raises
    ------
    UsageError : ``PANDAS``: pandas is not installed; a plan without a path, or without a frame.
    """
    columns = _columns(noun, frame)
    try:
        import pandas
    except ImportError:
        raise UsageError(
            "PANDAS", "to_pandas needs pandas, which is not installed", todo="pip install 'lampyris[pandas]'"
        ) from None
    return pandas.DataFrame(columns)


def _columns(noun: object, frame: MapFrame | None) -> Columns:
    if isinstance(noun, Trace):
        return trace_columns(noun)
    if isinstance(noun, Drive):
        return drive_columns(noun)
    if isinstance(noun, Profile):
        return profile_columns(noun, frame)
    if not isinstance(noun, Plan) or noun.path is None:
        raise UsageError("PANDAS", "this plan has no path", allowed="a plan whose status is found")
    if frame is None:
        what = "this plan does not know its map, and so no metres"
        raise UsageError(
            "PANDAS", what, where="grid", allowed="the grid of the scene: plan.to_pandas(scene.grid)"
        )
    return plan_columns(noun, noun.path, frame)
