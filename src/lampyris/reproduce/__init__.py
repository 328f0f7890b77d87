"""What the dissertation printed, what we get, and a verdict on every figure.

    report = reproduce(Path("reproduction"))
    report.counts["misprint"], report.page

The printed figures and their verdicts need no runs (:mod:`lampyris.reproduce.tables.printed`). Beside them stand
runs of ours on our maps: they go into stores in the folder, so that they can be stopped and continued.
"""

from __future__ import annotations

from lampyris.reproduce.runs.runs import RunProgress
from lampyris.reproduce.tables.verdict import KINDS, Verdict
from lampyris.reproduce.work import Report, reproduce

__all__ = ["KINDS", "Report", "RunProgress", "Verdict", "reproduce"]
