"""Statements of a module, without its expressions: nine tenths of a syntax tree are expressions."""

from __future__ import annotations

import ast
from collections.abc import Iterator


def statements(tree: ast.AST) -> Iterator[ast.stmt]:
    """Every statement of a module or of a statement, however deep."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        for one in getattr(tree, name, ()):
            if isinstance(one, ast.stmt):
                yield one
            yield from statements(one)
