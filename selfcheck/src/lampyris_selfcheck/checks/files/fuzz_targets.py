"""What is fuzzed: each parser with its good files, how it is called, and what its results must be like."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from lampyris import movingai
from lampyris.io.fleet_scenario.scenario import FleetScenario
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris.io.maps.zones import read_zones
from lampyris.io.paths import PathPoints, read_path_points
from lampyris.io.primitives.load import load_primitives
from lampyris.io.scenario.robot_file import read_robot
from lampyris.io.scenario.scenario import Scenario
from lampyris.io.text.strict_json import read_json
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.io.tracks import dob
from lampyris.io.tracks.csv_tracks import read_track
from lampyris.io.tracks.obstacle_states import read_obstacle_states
from lampyris.model.grid import Grid
from lampyris.model.lattice.motion_primitives import MotionPrimitives
from lampyris.model.photos.segmented_photo import SegmentedPhoto
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.settings.photo import CHANNELS
from lampyris.photos.segment import segment_photo
from lampyris.planning.lattice.sampled import sampled
from lampyris.scenarios import load_scenario
from lampyris_selfcheck.checks.files import fuzz_study as of_study
from lampyris_selfcheck.checks.files import fuzz_valid as valid
from lampyris_selfcheck.reference.files import corpora


class Mutants(Protocol):
    """Good files, and mutants of them."""

    @property
    def seeds(self) -> tuple[bytes, ...]:
        """The good files."""

    def mutant(self, rng: np.random.Generator) -> bytes:
        """One mutant."""


@dataclass(frozen=True)
class Target:
    """A parser.

    Parameters
    ----------
    corpus : good files, or a function that makes them when they are needed.
    file : what a mutant is called in its folder.
    call : given the file and a number from 0 on (to vary options by), reads it.
    check : raises if a result is not a valid object.
    beside : other files of the folder.
    writes : whether the call may write into the folder.
    against : given a result and the file it is of, raises if the file says otherwise.
    """

    corpus: Mutants | Callable[[], Mutants]
    file: str
    call: Callable[[Path, int], Any]
    check: Callable[[Any], None]
    beside: Mapping[str, bytes] = field(default_factory=dict)
    writes: bool = False
    against: Callable[[Any, bytes], None] | None = None

    @property
    def mutants(self) -> Mutants:
        """The good files, made if need be."""
        return self.corpus() if callable(self.corpus) else self.corpus


def _map(path: Path, k: int) -> MapDocument:
    """A map, with each choice of options in turn; always as a stranger's."""
    numbers = path.suffix not in (".map", ".txt")
    values = "costmap" if k % (5 if numbers else 50) == 0 else "occupancy"
    return load_map(path, strict=True, values=values, colour="luminance" if k % 7 == 0 else "legend")


def _ros_picture(path: Path, k: int) -> MapDocument:
    """The map whose picture the file is."""
    return _map(path.with_suffix(".yaml"), k)


def _way(path: Path, k: int) -> PathPoints:
    """A way, in each unit; on a map."""
    found = read_path_points(path, (None, "metres", "cells")[k % 3])
    found.on(valid.PLAIN)
    return found


def _obstacles(path: Path, k: int) -> list[Any]:
    """The obstacles of a ``.dob``, and their tracks on some grid."""
    grid = Grid(np.zeros((6, 7), dtype=bool))
    made: list[Any] = []
    for number, one in enumerate(dob.read_dob(path.read_bytes(), path.name)):
        body, notes = dob.recorded(one, number, grid, 0.5 + k % 3, path.name)
        for note in notes:
            valid.words(note)
        made.append(body)
    return made


def _scenario(path: Path, _: int) -> Scenario | FleetScenario:
    return load_scenario(path, max_cells=of_study.MAX_CELLS)


def _primitives(path: Path, k: int) -> MotionPrimitives:
    """Motion primitives, and those that a robot of each kind can drive."""
    found = load_primitives(path)
    if k % 2 == 0:
        list(sampled(found, DRIVES[k % 3], k % 5 * 0.3 / found.resolution, k % 4 == 0))
    return found


def _photo(path: Path, k: int) -> SegmentedPhoto:
    """The map of a photograph, with each channel and several sizes of cells."""
    free = "dark" if k % 2 else "bright"
    return segment_photo(
        path, channel=CHANNELS[k % 4], cell=1 + k % 3, median=1 + 2 * (k % 5 == 0), free=free
    )


def _zones(path: Path, _: int) -> Any:
    return read_zones(path, valid.SMALL, 1.0)


def _as_its_picture(found: MapDocument, _: bytes) -> None:
    valid.as_the_file_says(found, corpora.ROS_PICTURE)


def _of_maps(corpus: Mutants, file: str) -> Target:
    """The target of a reader of maps."""
    return Target(corpus, file, _map, valid.document, against=valid.as_the_file_says)


_BESIDE = corpora.SCENARIO_BESIDE
TARGETS: Mapping[str, Target] = {
    "png": _of_maps(corpora.PNG, "m.png"),
    "bmp": _of_maps(corpora.BMP, "m.bmp"),
    "pgm": _of_maps(corpora.PGM, "m.pgm"),
    "ros": Target(
        corpora.ROS, "m.yaml", _map, valid.document, {"m.pgm": corpora.ROS_PICTURE}, against=_as_its_picture
    ),
    "map": _of_maps(corpora.MAP, "m.map"),
    "scen": Target(
        corpora.SCEN, "m.scen", lambda p, k: movingai.load(p), valid.benchmark, {"a.map": corpora.SCEN_MAP}
    ),
    "scenario-json": Target(corpora.SCENARIO_JSON, "s.json", _scenario, valid.scenario, _BESIDE),
    "study-json": Target(
        corpora.STUDY_JSON, "s.json", of_study.read_study, of_study.study, corpora.STUDY_BESIDE
    ),
    "store": Target(of_study.stores, of_study.STORE, of_study.read_store, of_study.contents),
    "store-repair": Target(
        of_study.stores, of_study.STORE, of_study.read_repaired, of_study.contents, writes=True
    ),
    "study-yaml": Target(
        corpora.STUDY_YAML, "s.yaml", of_study.read_study, of_study.study, corpora.STUDY_BESIDE
    ),
    "scenario-yaml": Target(corpora.SCENARIO_YAML, "s.yaml", _scenario, valid.scenario, _BESIDE),
    "npy": _of_maps(corpora.NPY, "m.npy"),
    "csv": _of_maps(corpora.CSV, "m.csv"),
    "text": _of_maps(corpora.TEXT, "m.txt"),
    "ros-picture": Target(
        corpora.ROS_PICTURES,
        "m.pgm",
        _ros_picture,
        valid.document,
        {"m.yaml": corpora.ROS_YAML},
        against=valid.as_the_file_says,
    ),
    "yaml": Target(corpora.YAML, "m.yaml", lambda p, k: read_yaml(p.read_bytes(), "m.yaml"), valid.data),
    "json": Target(corpora.JSON, "m.json", lambda p, k: read_json(p.read_bytes(), "m.json"), valid.data),
    "track": Target(corpora.TRACK, "t.csv", lambda p, k: read_track(p), valid.track),
    "way": Target(corpora.WAY, "w.csv", _way, valid.way),
    "way-json": Target(corpora.WAY_JSON, "w.json", _way, valid.way),
    "way-yaml": Target(corpora.WAY_YAML, "w.yaml", _way, valid.way),
    "movers": Target(
        corpora.MOVERS, "m.csv", lambda p, k: read_obstacle_states(p, valid.PLAIN), valid.movers
    ),
    "zones": Target(corpora.ZONES, "z.csv", _zones, valid.zones),
    "zones-npy": Target(corpora.ZONES_NPY, "z.npy", _zones, valid.zones),
    "dob": Target(corpora.DOB, "t.dob", _obstacles, valid.obstacles),
    "mprim": Target(corpora.MPRIM, "p.mprim", _primitives, valid.primitives),
    "primitives-json": Target(corpora.PRIMITIVES_JSON, "p.json", _primitives, valid.primitives),
    "photo": Target(corpora.PHOTO, "p.jpg", _photo, valid.photo),
    "robot": Target(corpora.ROBOT, "r.yaml", lambda p, k: Robot(**read_robot(p)), valid.robot),
}
