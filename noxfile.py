"""The same steps as the Makefile's, for systems without make: `nox -s tests`, `nox -s lint`."""

import nox

nox.options.sessions = ["lint", "tests"]


@nox.session
def tests(session: nox.Session) -> None:
    """The suite without browsers and without the large sizes."""
    session.install("-e", ".[dev]", "-e", "./selfcheck")
    session.run("pytest", "-q", "-n", "auto", "-m", "not nightly", "--ignore", "tests/app", *session.posargs)


@nox.session
def lint(session: nox.Session) -> None:
    """Style, types and layers."""
    session.install("-e", ".[dev]", "-e", "./selfcheck")
    session.run("ruff", "check", ".")
    session.run("mypy")
    session.run("lint-imports")
