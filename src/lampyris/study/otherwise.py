"""Otherwise: remarks on runs in which something was done otherwise than asked, such as a wish weakened."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

QUOTED = 3
"""Different notes that a remark quotes, the most frequent first."""


def remark(who: str, notes: Sequence[str]) -> str:
    """A sentence on the notes of a planner's runs; empty where no run has any.

    Parameters
    ----------
    who : whose runs they are.
    notes : of each run, empty where nothing was done otherwise than asked.
    """
    counts = Counter(note for note in notes if note)
    if not counts:
        return ""
    if len(notes) == 1:
        return f"{who}: {notes[0]}"
    order = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    quoted = [note if len(order) == 1 else f"{note} ({n:,})" for note, n in order[:QUOTED]]
    left = len(order) - len(quoted)
    quoted += [f"{left:,} other {'note' if left == 1 else 'notes'}"] if left else []
    what = f"{counts.total():,} of {len(notes):,} runs of {who}"
    return f"{what} did otherwise than asked: {'; '.join(quoted)}"
