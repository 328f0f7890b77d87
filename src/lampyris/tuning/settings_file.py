"""The study with the tuned planner or speed law alone, as a file that `lampyris study` runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import yaml

from lampyris import __version__
from lampyris.errors import UsageError
from lampyris.io.files import write_file
from lampyris.study.design.study_file import plain_study
from lampyris.tuning.tune import Tuned


def write_settings(study: str, found: Tuned, path: Path) -> None:
    """Write the study file with what was tuned in place of its planners (or its speed laws), every setting stated.

    Parameters
    ----------
    study : the file that was tuned on, or the name of a bundled one.
    found : what was found.
    path : the file, in the folder of the study if that names files.

    Raises
    ------
    UsageError : ``OPTIONS``: another folder, from which names of files in the study would be wrong.
    FileError : it cannot be written.
    """
    data = plain_study(study)
    demand_folder(study, data, path)
    data["name"] = f"{data.get('name', 'study')}-tuned"
    entry = {"name": found.chosen.name, "settings": dict(found.chosen.settings), "label": "tuned"}
    data[f"{found.kind}s"] = [entry]
    if found.planner is not None:
        behind = {"name": found.planner.name, "settings": dict(found.planner.settings)}
        data["planners"] = [behind | ({"label": found.planner.label} if found.planner.label else {})]
    head = (
        f"# {found.chosen.name} tuned by lampyris {__version__}: {found.measure.name}, {found.measure.better} is better, "
        f"{len(found.trials)} trials on {found.queries} queries.\n"
    )
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=110)
    write_file(path, (head + text).encode("utf-8"))


def demand_folder(study: str, data: dict[str, Any], path: Path) -> None:
    """Refuse a folder from which names of files in the study would be wrong.

    Raises
    ------
    UsageError : ``OPTIONS``.
    """
    maps = data.get("maps", [])
    names = [m for m in maps if isinstance(m, dict) and ({"file", "scen"} & m.keys())]
    here = os.path.realpath(Path(study).parent) == os.path.realpath(path.parent)
    if names and not here:
        what = "the study names files relative to its folder"
        raise UsageError("OPTIONS", what, where="out", allowed=f"a file in {Path(study).parent}")
