"""Notes of a run: the latest about each setting."""

from __future__ import annotations

from lampyris.sim.world.notes import Notes


def test_the_latest_about_each_setting_is_kept_in_order() -> None:
    notes = Notes()
    notes.add(("keep_away 3 was weakened to 0 cells: no path to the goal keeps more", "5 cells cost most"))
    notes.add(("keep_away 3 was weakened to 2 cells: the best path would be longer", "7 cells cost most"))
    notes.add(("crowding 4 was weakened to 0.25: the best path would be longer",))
    notes.add(())
    assert notes.all() == (
        "keep_away 3 was weakened to 2 cells: the best path would be longer",
        "7 cells cost most",
        "crowding 4 was weakened to 0.25: the best path would be longer",
    )
