"""The hundred bad inputs: one module for each group of rows, every byte of their files written by code.

A row of the table is a number; most rows have several cases. What is not a case says where it is asked, or
what it waits for.
"""

from __future__ import annotations

from bad_inputs import command_line, movingai, pictures, ros, scen, scenarios, speed
from bad_inputs.case import Case

CASES: tuple[Case, ...] = (
    *pictures.CASES,
    *ros.CASES,
    *movingai.CASES,
    *scen.CASES,
    *scenarios.CASES,
    *command_line.CASES,
    *speed.CASES,
)
ELSEWHERE = {
    89: "a speed at the start too fast to stop from: lampyris.profile is asked; and `speed --v0`, in row 99",
    100: "Ctrl-C and a reader that leaves: a process of its own",
}
"""Rows with a test of their own."""
DEFERRED = {
    92: "a deadline: there is none yet; budgets by time come with studies (issue 6)",
    93: "a sweep of too many cases: studies (issue 6)",
    94: "resuming with other inputs: the store of studies (issue 6)",
    95: "a damaged store: the store of studies (issue 6)",
    96: "a store open in another process: the store of studies (issue 6)",
    97: "a store that cannot be written: the store of studies (issue 6)",
    98: "a worker's result that fails validation: studies (issue 6)",
}
"""Rows that wait for what does not exist yet."""
