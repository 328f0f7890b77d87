"""The loop by hand: who may step where, hits, patience, endings, streams, speeds."""

from __future__ import annotations

import numpy as np
import pytest
from sim_planners import Breadth, Scripted, drive, fail, found, grid_of, row

from lampyris.errors import InternalFault, SettingError, UsageError
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.sim.grid.loop import Simulation, run
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor

ROOM = grid_of("......", "......", "......", "......")
LANE = grid_of("......")


def words(trace):
    return [(e.tick, e.word) for e in trace.events]


def test_an_empty_room():
    trace = run(Scene(ROOM, (0, 0), (5, 0)), Scripted((drive(row(0, 0, 5)),)))
    assert trace.outcome is Outcome.ARRIVED
    assert trace.robot.tolist() == [[x, 0] for x in range(6)]
    assert (trace.ticks, trace.waits, trace.replans, trace.iterations) == (5, 0, 0, 1)
    assert words(trace) == [(5, "arrive")]
    assert trace.path is not None
    assert trace.path.steps == (5, 0)
    assert trace.cost == 5.0
    assert set(trace.timing) == {"total_s", "planning_s", "loading_s"}
    assert 0 <= trace.timing["planning_s"] <= trace.timing["total_s"]


def test_start_on_the_goal_arrives_at_once():
    trace = run(Scene(ROOM, (2, 2), (2, 2)), Breadth())
    assert trace.outcome is Outcome.ARRIVED
    assert trace.ticks == 0
    assert trace.cost == 0.0


@pytest.mark.parametrize(
    ("rows", "outcome"),
    [
        (("#.#.", "..#."), Outcome.START_OCCUPIED),
        (("..#.", "..##"), Outcome.GOAL_OCCUPIED),
        (("..#.", "..#."), Outcome.NO_PATH),
    ],
)
@pytest.mark.parametrize("traffic", [(), (RandomWalk(1),)])
def test_what_never_can_be_driven_is_one_tick(rows, outcome, traffic):
    trace = run(Scene(grid_of(*rows), (0, 0), (3, 1), traffic=traffic), Breadth())
    assert trace.outcome is outcome
    assert trace.ticks == 0
    assert trace.path is None
    assert trace.cost == 0.0
    assert trace.sentence


def test_an_obstacle_in_the_only_door_is_waited_for_not_no_path():
    grid = grid_of("...#...", ".......", "...#...")
    track = ((3, 1),) * 6 + ((4, 0), (5, 0))
    trace = run(Scene(grid, (0, 1), (6, 2), traffic=Recorded(track)), Breadth())
    assert trace.outcome is Outcome.ARRIVED
    assert trace.waits >= 1
    assert Monitor(trace).faults() == []


def test_patience_ends_in_blocked_with_a_sentence():
    scene = Scene(LANE, (0, 0), (5, 0), traffic=Recorded(((3, 0),)))
    trace = run(scene, Scripted((drive(row(0, 0, 5)),)), patience=4)
    assert trace.outcome is Outcome.BLOCKED
    assert trace.robot.tolist() == [[0, 0], [1, 0], [2, 0]] + [[2, 0]] * 5
    assert trace.waits == 5
    assert [e.word for e in trace.events].count("wait") == 5
    assert "5 ticks in a row at (2, 0)" in trace.sentence
    assert trace.cause[-5:] == ("waiting",) * 5


def test_the_default_patience_is_fifty_and_zero_never_waits():
    scene = Scene(LANE, (0, 0), (5, 0), traffic=Recorded(((1, 0),)))
    assert run(scene, Scripted((fail(),))).waits == 51
    impatient = run(scene, Scripted((fail(),)), patience=0)
    assert impatient.waits == 1
    assert impatient.sentence.startswith("Waited 1 tick at (0, 0); the patience is 0.")


def test_the_planners_last_word_is_in_the_sentence():
    scene = Scene(LANE, (0, 0), (5, 0), traffic=Recorded(((1, 0),)))
    trace = run(scene, Scripted((fail(Status.ITERATION_LIMIT),)), patience=2)
    assert trace.outcome is Outcome.BLOCKED
    assert Status.ITERATION_LIMIT.sentence in trace.sentence


def test_waiting_is_counted_in_a_row_only():
    # Two doors, each shut for two ticks more when it is reached: four waits, never three in a row.
    a = ((1, 0),) * 3 + ((1, 1),)
    b = ((4, 0),) * 8 + ((4, 1),)
    grid = grid_of("......", "......")
    scene = Scene(grid, (0, 0), (5, 0), traffic=(Recorded(a), Recorded(b)))
    trace = run(scene, Scripted((drive(row(0, 0, 5)),)), patience=2)
    assert trace.outcome is Outcome.ARRIVED
    assert trace.waits == 4


def test_timeout():
    trace = run(Scene(LANE, (0, 0), (5, 0)), Scripted((drive(row(0, 0, 5)),)), ticks=3)
    assert trace.outcome is Outcome.TIMEOUT
    assert trace.ticks == 3
    assert "tick 3" in trace.sentence
    arrived = run(Scene(LANE, (0, 0), (5, 0)), Scripted((drive(row(0, 0, 5)),)), ticks=5)
    assert arrived.outcome is Outcome.ARRIVED


def test_the_default_end_is_stated():
    scene = Scene(LANE, (0, 0), (5, 0), traffic=Recorded(((1, 0),)))
    trace = run(scene, Scripted((drive(row(0, 0, 5)),)), patience=10_000)
    assert trace.outcome is Outcome.TIMEOUT
    assert trace.ticks == 10 * (1 + 6) + 4 * 5


# ---- hits --------------------------------------------------------------------------------------------------


def test_hit_by_a_track_that_does_not_yield():
    scene = Scene(LANE, (2, 0), (0, 0), traffic=Recorded(tuple((x, 0) for x in (4, 3, 2, 1))))
    trace = run(scene, Scripted((fail(),)))
    assert trace.outcome is Outcome.HIT
    assert trace.ticks == 2
    assert trace.robot.tolist() == [[2, 0]] * 3
    assert trace.tracks[0][-1].tolist() == [2, 0]
    assert (trace.hits, trace.collisions) == (1, 0)
    assert words(trace)[-1] == (2, "hit")
    assert Monitor(trace).faults() == []


def test_the_planned_step_leaves_in_time():
    scene = Scene(LANE, (2, 0), (0, 0), traffic=Recorded(tuple((x, 0) for x in (3, 2, 1, 0))))
    trace = run(scene, Scripted((drive([(2, 0), (1, 0), (0, 0)]),)))
    # Tick 1: it comes onto (2, 0) and the robot goes to (1, 0). Tick 2: the same again.
    assert trace.robot.tolist() == [[2, 0], [1, 0], [0, 0]]
    assert trace.outcome is Outcome.ARRIVED
    assert Monitor(trace).faults() == []


def test_a_swap_is_no_way_out():
    # Head-on in a lane: the only free neighbour is where the obstacle has just come from.
    scene = Scene(LANE, (2, 0), (5, 0), traffic=Recorded(((3, 0), (2, 0))))
    trace = run(scene, Scripted((drive(row(0, 2, 5)),)))
    assert trace.outcome is Outcome.HIT
    assert trace.robot.tolist() == [[2, 0], [2, 0]]


def test_a_re_chosen_step_leaves_in_time():
    # Head-on in the open: the planned step is a swap, the re-chosen one goes aside.
    scene = Scene(ROOM, (2, 1), (5, 1), traffic=Recorded(((3, 1), (2, 1), (1, 1))))
    planner = Scripted((drive(row(1, 2, 5)), lambda s, c: found([(2, 1), (3, 0), (4, 1), (5, 1)], s)))
    trace = run(scene, planner)
    assert trace.robot.tolist() == [[2, 1], [3, 0], [4, 1], [5, 1]]
    assert trace.replans == 1
    # The planner was told that the cell the obstacle came from is closed in this tick, and not of its own
    # cell.
    assert planner.told[1].obstacles == {(3, 1)}
    assert planner.told[1].robot == (2, 1)


def test_a_planner_is_asked_once_more_before_a_hit():
    scene = Scene(ROOM, (2, 1), (5, 1), traffic=Recorded(((3, 1), (2, 1), (1, 1))))
    planner = Scripted((drive(row(1, 2, 5)), fail(), lambda s, c: found([(2, 1), (3, 0), (4, 1), (5, 1)], s)))
    trace = run(scene, planner)
    assert trace.outcome is Outcome.ARRIVED
    assert trace.replans == 2


def test_one_that_comes_beside_is_not_a_hit():
    scene = Scene(ROOM, (2, 1), (2, 3), traffic=Recorded(((4, 1), (3, 1), (3, 1))))
    trace = run(scene, Scripted((fail(),)), patience=3)
    assert trace.outcome is Outcome.BLOCKED
    assert trace.hits == 0


# ---- legal steps -------------------------------------------------------------------------------------------


def test_the_robot_never_crosses_a_diagonal():
    # The obstacle drives (1, 0) -> (0, 1) in the tick in which the robot wants (0, 0) -> (1, 1).
    scene = Scene(ROOM, (0, 0), (3, 3), traffic=Recorded(((1, 0), (0, 1), (0, 2))))
    way = [(0, 0), (1, 1), (2, 2), (3, 3)]
    planner = Scripted((drive(way),))
    trace = run(scene, planner)
    assert trace.robot.tolist()[:3] == [[0, 0], [0, 0], [1, 1]]
    assert (1, 1) in planner.told[1].obstacles
    assert trace.outcome is Outcome.ARRIVED


def test_the_robot_may_follow_and_may_pass_parallel():
    follow = Scene(LANE, (0, 0), (3, 0), traffic=Recorded(((1, 0), (2, 0), (3, 0), (4, 0))))
    assert run(follow, Scripted((drive(row(0, 0, 3)),))).waits == 0
    beside = Scene(ROOM, (0, 0), (2, 2), traffic=Recorded(((1, 0), (2, 1), (3, 2))))
    assert run(beside, Scripted((drive([(0, 0), (1, 1), (2, 2)]),))).waits == 0


def test_walls_bind_the_step_whatever_the_plan_says():
    grid = grid_of("..", "#.")
    trace = run(Scene(grid, (0, 0), (1, 1)), Scripted((drive([(0, 0), (1, 1)]),)), patience=2)
    assert trace.outcome is Outcome.BLOCKED
    cutting = run(Scene(grid, (0, 0), (1, 1), "dissertation"), Scripted((drive([(0, 0), (1, 1)]),)))
    assert cutting.outcome is Outcome.ARRIVED


def test_a_robot_with_a_size_keeps_off_with_all_of_it():
    grid = Grid(np.zeros((7, 12), dtype=bool))
    scene = Scene(grid, (2, 3), (9, 3), robot=Robot(radius=1.0), traffic=Recorded(((6, 3),)))
    planner = Scripted((drive(row(3, 2, 9)),))
    trace = run(scene, planner, patience=3)
    # Footprint 3 x 3: the nearest it may come is two cells away.
    assert trace.robot.tolist()[-1] == [4, 3]
    assert planner.told[-1].obstacles == {(x, y) for x in (5, 6, 7) for y in (2, 3, 4)}
    assert Monitor(trace).faults() == []


def test_a_knights_step_sweeps_what_lies_between():
    grid = Grid(np.zeros((4, 5), dtype=bool))
    way = [(0, 0), (2, 1)]
    free = Scene(grid, (0, 0), (2, 1), "sixteen-connected", traffic=Recorded(((4, 3),)))
    assert run(free, Scripted((drive(way),))).ticks == 1
    taken = Scene(grid, (0, 0), (2, 1), "sixteen-connected", traffic=Recorded(((1, 1),)))
    assert run(taken, Scripted((drive(way),)), patience=1).outcome is Outcome.BLOCKED


# ---- asking ------------------------------------------------------------------------------------------------


def test_asked_again_when_the_committed_steps_are_driven():
    planner = Scripted((drive(row(0, 0, 5), commit=2),))
    trace = run(Scene(LANE, (0, 0), (5, 0)), planner)
    assert [c.robot for c in planner.told] == [(0, 0), (2, 0), (4, 0)]
    assert trace.replans == 0
    assert trace.iterations == 3


def test_a_plan_that_is_not_driven_is_not_an_iteration():
    scene = Scene(
        LANE, (0, 0), (5, 0), traffic=Recorded(((1, 0),) * 3 + ((2, 0), (3, 0), (4, 0), (5, 0), (5, 0)))
    )
    planner = Scripted((drive(row(0, 0, 5)),))
    trace = run(scene, planner, patience=2)
    # Ticks 1 and 2 are waits; from tick 3 on it follows one cell behind until the obstacle parks on the goal.
    assert trace.robot.tolist()[3:7] == [[1, 0], [2, 0], [3, 0], [4, 0]]
    assert trace.iterations == 1
    assert trace.outcome is Outcome.BLOCKED


def test_gates_met_are_told_once():
    def gate(scene, change):
        return found(row(0, change.robot[0], 5), scene, commit=1, gates_met=((3, 0),))

    trace = run(Scene(LANE, (0, 0), (5, 0)), Scripted((gate,)))
    assert [e.cell for e in trace.events if e.word == "gate"] == [(3, 0)]
    assert trace.replans == 1


def test_a_plan_from_elsewhere_is_a_fault_of_the_planner():
    with pytest.raises(InternalFault, match="PLAN_START"):
        run(Scene(LANE, (0, 0), (5, 0)), Scripted((lambda s, c: found(row(0, 1, 5), s),)))


def test_an_obstacle_on_the_goal_is_waited_for():
    track = ((5, 0),) * 12 + ((5, 1), (5, 2))
    scene = Scene(ROOM, (0, 0), (5, 0), traffic=Recorded(track))
    trace = run(scene, Breadth())
    assert trace.outcome is Outcome.ARRIVED
    assert trace.ticks >= 12
    assert Monitor(trace).faults() == []
    parked = Scene(ROOM, (0, 0), (5, 0), traffic=Recorded(((5, 0),)))
    assert run(parked, Breadth(), patience=5).outcome is Outcome.BLOCKED
    says_so = Scripted(
        (lambda s, c: Plan(Status.GOAL_OCCUPIED, "test") if c.obstacles else drive(row(0, 0, 5))(s, c),)
    )
    assert run(parked, says_so, patience=5).outcome is Outcome.BLOCKED


# ---- settings, streams, sameness ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bad", "kind"),
    [
        ({"ticks": 0}, SettingError),
        ({"ticks": 2.5}, SettingError),
        ({"patience": -1}, SettingError),
        ({"seed": -1}, SettingError),
        ({"seed": True}, SettingError),
        ({"law": "warp"}, UsageError),
    ],
)
def test_settings_out_of_range(bad, kind):
    with pytest.raises(kind):
        run(Scene(LANE, (0, 0), (5, 0)), Breadth(), **bad)


CROWD = Scene(
    Grid(np.zeros((20, 20), dtype=bool)),
    (0, 0),
    (19, 19),
    traffic=(RandomWalk(10), Crossing(3), Patrol(((5, 5), (15, 5), (9, 12))), RandomWalk(4, rate=0.3)),
)


def told(trace):
    return (
        trace.outcome,
        trace.robot.tolist(),
        [t.tolist() for t in trace.tracks],
        trace.appears,
        trace.obstacle_specs,
        trace.speed.tolist(),
        trace.cause,
        trace.events,
        trace.replans,
        trace.waits,
        trace.expansions,
        trace.detail,
    )


def test_same_seed_same_trace_and_another_seed_another():
    assert told(run(CROWD, Breadth(), seed=4)) == told(run(CROWD, Breadth(), seed=4))
    assert told(run(CROWD, Breadth(), seed=4)) != told(run(CROWD, Breadth(), seed=5))


def test_stepping_by_hand_is_the_same_as_running():
    one = Simulation(CROWD, Breadth(), seed=8)
    while one.outcome is None:
        half = one.trace()
        assert half.ticks == one.now
        one.tick()
    one.tick()
    ticks = []
    assert told(one.trace()) == told(run(CROWD, Breadth(), seed=8, progress=ticks.append))
    assert ticks == list(range(1, one.now + 1))


def test_planners_have_their_own_stream_and_meet_the_same_obstacles():
    a, b = Scripted((fail(),)), Scripted((fail(Status.LIMIT),))
    one, two = run(CROWD, a, seed=3, patience=30), run(CROWD, b, seed=3, patience=30)
    assert [t.tolist() for t in one.tracks] == [t.tolist() for t in two.tracks]
    expected = np.random.Generator(np.random.PCG64(np.random.SeedSequence((3, 0)))).random()
    assert set(a.drawn) == set(b.drawn) == {expected}


def test_taking_out_one_specification_leaves_the_draws_of_those_before_it():
    alone = Scene(CROWD.grid, (0, 0), (19, 19), traffic=(RandomWalk(2),))
    more = Scene(CROWD.grid, (0, 0), (19, 19), traffic=(RandomWalk(2), RandomWalk(1, rate=0.01)))
    one = run(alone, Scripted((fail(),)), seed=3, patience=20)
    two = run(more, Scripted((fail(),)), seed=3, patience=20)
    assert [t.tolist() for t in one.tracks] == [t.tolist() for t in two.tracks[:2]]
