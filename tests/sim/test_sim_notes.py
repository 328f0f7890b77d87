"""Notes of a run: the worst about each setting."""

from __future__ import annotations

from lampyris.sim.world.notes import Notes


def test_the_worst_about_each_setting_is_kept_in_order() -> None:
    notes = Notes()
    notes.add(
        ("min_clearance 3 was weakened to 0 cells: no path to the goal keeps more", "5 cells cost most")
    )
    notes.add(("min_clearance 3 was weakened to 2 cells: the best path would be longer", "7 cells cost most"))
    notes.add(("obstacle_density_weight 4 was weakened to 0.25: the best path would be longer",))
    notes.add(())
    assert notes.all() == (
        "min_clearance 3 was weakened to 0 cells: no path to the goal keeps more",
        "7 cells cost most",
        "obstacle_density_weight 4 was weakened to 0.25: the best path would be longer",
    )


def test_a_lower_value_that_comes_later_replaces_a_higher_one() -> None:
    notes = Notes()
    for value in ("0.5", "0.25", "0.75"):
        notes.add((f"obstacle_density_weight 4 was weakened to {value}: the best path would be longer",))
    assert notes.all() == ("obstacle_density_weight 4 was weakened to 0.25: the best path would be longer",)
