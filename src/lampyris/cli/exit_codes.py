"""Exit codes of the command line; those of errors are attributes of their classes in `lampyris.errors`."""

from __future__ import annotations

BAD_INPUT = 3
NO_ANSWER = 4
"""No path, or the robot did not arrive: a valid answer."""
INTERNAL_FAULT = 6
INTERRUPTED = 130


class Interrupted(SystemExit):
    """Ctrl-C, raised after a line has said what is kept and how to continue."""
