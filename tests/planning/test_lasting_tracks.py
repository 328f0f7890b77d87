"""What tracks that end forbid is worked out once; later ticks take what is left of it."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.model.change import ObstacleTrack
from lampyris.planning.field.footprint import footprint
from lampyris.planning.spacetime.prediction import Forbidden, Forecaster
from lampyris.typing import BoolGrid, Cell

RNG = np.random.default_rng(7)
OWN = ((0, 0),)


def walk(free: BoolGrid, length: int) -> tuple[Cell, ...]:
    """A track of single steps within the map."""
    height, width = free.shape
    x, y = int(RNG.integers(width)), int(RNG.integers(height))
    track = [(x, y)]
    for _ in range(length - 1):
        dx, dy = RNG.integers(-1, 2, 2).tolist()
        x, y = min(max(x + dx, 0), width - 1), min(max(y + dy, 0), height - 1)
        track.append((x, y))
    return tuple(track)


def rows(found: Forbidden) -> tuple[object, ...]:
    """All that is forbidden, in one order."""
    sets = (sorted(map(tuple, part.tolist())) for part in (found.at, found.steps, found.forever))
    return (*sets, found.still, found.until)


@pytest.mark.parametrize("size", [0.0, 0.8])
def test_later_ticks_forbid_what_a_new_forecaster_says(size: float) -> None:
    """Recorded obstacles, some longer than others, one that goes round, and guessed ones; tracks come and go."""
    free = np.ones((12, 15), dtype=np.bool_)
    body = footprint(size, 1.0)
    ended = [ObstacleTrack(k, walk(free, 5 + 7 * (k % 3)), 0, 1, body if k % 2 else OWN) for k in range(9)]
    round_trip = walk(free, 6)
    endless = ObstacleTrack(9, round_trip + round_trip[-2:0:-1], 0, 10, OWN)
    kept = Forecaster(free, OWN, guess="velocity", growth=0.0)
    for tick in (0, 1, 2, 2, 5, 11, 30, 3):
        guessed = ObstacleTrack(10, walk(free, 2), max(tick - 1, 0), None, OWN)
        some = ended if tick != 5 else [one for one in ended if one.obstacle != 4]
        asked = [*some, endless, guessed]
        fresh = Forecaster(free, OWN, guess="velocity", growth=0.0)
        one, other = (who.forbidden(asked, tick, 2, 20) for who in (kept, fresh))
        assert rows(one) == rows(other)
        assert len(one.at)


def test_tracks_are_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    free = np.ones((9, 9), dtype=np.bool_)
    ended = [ObstacleTrack(k, walk(free, 8), 0, 1, OWN) for k in range(4)]
    kept = Forecaster(free, OWN, guess="velocity", growth=0.0)
    calls = []
    right = Forecaster._known
    monkeypatch.setattr(Forecaster, "_known", lambda self, *a: (calls.append(a), right(self, *a)))
    for tick in range(6):
        kept.forbidden(ended, tick, 2, 20)
    assert len(calls) == 1
    kept.forbidden(ended[1:], 6, 2, 20)
    assert len(calls) == 2


def test_tracks_that_begin_later_are_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """They once were again at every tick before their first, and all safe intervals with them."""
    free = np.ones((9, 9), dtype=np.bool_)
    later = [ObstacleTrack(k, walk(free, 8), 4, 1, OWN) for k in range(4)]
    kept, fresh = (Forecaster(free, OWN, guess="velocity", growth=0.0) for _ in range(2))
    known = [kept.forecast(later, tick, 2, 20)[0][0] for tick in range(7)]
    assert len({one.serial for one in known}) == 1
    for tick in (0, 4, 6):
        assert rows(kept.forbidden(later, tick, 2, 20)) == rows(fresh.forbidden(later, tick, 2, 20))


def test_a_list_given_as_a_track_may_be_changed_in_place() -> None:
    free = np.ones((9, 9), dtype=np.bool_)
    track = list(walk(free, 8))
    seen = ObstacleTrack(0, track, 0, 1, OWN)  # type: ignore[arg-type]
    kept = Forecaster(free, OWN, guess="velocity", growth=0.0)
    kept.forbidden([seen], 0, 2, 20)
    track[:] = walk(free, 8)
    fresh = Forecaster(free, OWN, guess="velocity", growth=0.0)
    one, other = (who.forbidden([seen], 1, 2, 20) for who in (kept, fresh))
    assert rows(one) == rows(other)
