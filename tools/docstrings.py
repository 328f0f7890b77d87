"""Check the docstrings of all public names: `python tools/docstrings.py`, which `make docs` runs first.

numpydoc's validator judges sections, summaries and parameters; doctest runs the examples in an empty folder. A
parameter is one line, ``name : what it means``, and types stand in the signature alone, so what numpydoc says of types
in docstrings (PR05 to PR09, RT02 to RT05) is not asked; nor are See Also and extended summaries, and summaries may name
what comes back ("A path from ...", SS05).
"""

from __future__ import annotations

import contextlib
import doctest
import enum
import importlib
import inspect
import io
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from typing import Any

import lampyris

CHECKS = (
    "GL01 GL02 GL03 GL05 GL06 GL07 GL08 GL09 GL10 SS01 SS02 SS03 SS04 SS06 PR01 PR02 PR03 PR04 PR10 YD01 EX01"
)
LONGEST = 5
"""Lines of an example that are typed."""


def public() -> Iterator[tuple[str, Any]]:
    """Every public class and function, by name."""
    for name in lampyris.__all__:
        found = getattr(lampyris, name)
        if callable(found):
            yield name, found


def faults() -> list[str]:
    """What numpydoc refuses, and examples that are too long."""
    validate = importlib.import_module("numpydoc.validate").validate
    asked = set(CHECKS.split())
    said = []
    for name, found in public():
        wrong = {(code, text) for code, text in validate(f"lampyris.{name}")["errors"] if code in asked}
        if isinstance(found, type) and issubclass(found, enum.Enum | BaseException):
            # Their constructors are Python's own, or one for all errors.
            wrong = {(code, text) for code, text in wrong if code != "PR01"}
        said += [f"{name}: {code} {text}" for code, text in sorted(wrong)]
        lines = sum(line.startswith((">>> ", "... ")) for line in (inspect.getdoc(found) or "").splitlines())
        if lines > LONGEST:
            said.append(f"{name}: an example of {lines} lines")
    return said


def failed(names: Iterable[str] = ()) -> list[str]:
    """The reports of examples that do not give what they say; of these names, or of all."""
    said = []
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for name in names or (name for name, _ in public()):
                found = getattr(lampyris, name)
                home = vars(sys.modules[found.__module__])
                test = doctest.DocTestParser().get_doctest(
                    inspect.getdoc(found) or "", dict(home), name, None, 0
                )
                report = io.StringIO()
                with contextlib.redirect_stdout(io.StringIO()):
                    doctest.DocTestRunner().run(test, out=report.write)
                if not test.examples:
                    said.append(f"{name}: no example")
                if report.getvalue():
                    said.append(report.getvalue())
        finally:
            os.chdir(before)
    return said


def main() -> int:
    """Print what is wrong; 1: something is."""
    wrong = [*faults(), *failed()]
    print("\n".join(wrong) if wrong else f"docstrings of {sum(1 for _ in public())} public names: no fault")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
