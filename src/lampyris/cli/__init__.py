"""The command line: one function for each verb.

Exit codes: 0 done, 2 usage, 3 bad input, 4 no path or not arrived (a valid answer), 5 limit, 6 internal
fault, 130 interrupted.
"""

from __future__ import annotations

import os
import sys

from lampyris.errors import LampyrisError

BAD_INPUT = 3
INTERNAL_FAULT = 6
INTERRUPTED = 130


def main() -> None:
    """Run the command line; every way out has its exit code, and none is a traceback."""
    if sys.stdout is None:
        print("error[FILE_WRITE]: standard output is closed", file=sys.stderr)
        sys.exit(BAD_INPUT)
    try:
        from lampyris.cli.app import app

        app(standalone_mode=True)
    except SystemExit as done:
        if done.code == INTERRUPTED:
            print("interrupted", file=sys.stderr)  # typer has said nothing
        raise
    except LampyrisError as error:
        print(error, file=sys.stderr)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        # The reader (`| head`) has left. Python would complain again when it flushes stdout at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except OSError as error:
        if os.environ.get("LAMPYRIS_DEBUG"):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"error[FILE_WRITE]: {error.strerror or error}", file=sys.stderr)
        sys.exit(BAD_INPUT)
    except Exception as error:
        if os.environ.get("LAMPYRIS_DEBUG"):
            raise
        print(
            f"error[INTERNAL]: {type(error).__name__}: {error}; a fault of lampyris, please report it; "
            "LAMPYRIS_DEBUG=1 shows where",
            file=sys.stderr,
        )
        sys.exit(INTERNAL_FAULT)
