"""The hundred bad inputs: one module for each group of rows, every byte of their files written by code.

A row of the table is a number; most rows have several cases. What is not a case says where it is asked, or
what it waits for.
"""

from __future__ import annotations

from bad_inputs import command_line, movingai, pictures, queries, ros, scenarios, speed, studies
from bad_inputs.case import Case

CASES: tuple[Case, ...] = (
    *pictures.CASES,
    *ros.CASES,
    *movingai.CASES,
    *queries.CASES,
    *scenarios.CASES,
    *command_line.CASES,
    *speed.CASES,
    *studies.CASES,
)
ELSEWHERE = {
    89: "a speed at the start too fast to stop from: lampyris.speed_profile is asked; and `speed --v0`, in row 99",
    96: "a store that another process writes to",
    98: "a worker's result that is not one: tests/study/test_study_run.py",
    100: "Ctrl-C and a reader that leaves: a process of its own",
}
"""Rows with a test of their own."""
DEFERRED: dict[int, str] = {}
"""Rows that wait for what does not exist yet."""
