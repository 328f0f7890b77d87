"""What is a set, as far as annotations and assignments say: for tools/determinism_rules.py."""

from __future__ import annotations

import ast

SET_TYPES = frozenset({"set", "frozenset", "Set", "AbstractSet", "MutableSet"})


def said_sets(trees: list[ast.Module]) -> frozenset[str]:
    """Names of attributes and properties that are sets in some class, and nothing else in another."""
    classes = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    other = {
        one.target.id
        for of in classes
        for one in of.body
        if isinstance(one, ast.AnnAssign)
        and isinstance(one.target, ast.Name)
        and not is_set_type(one.annotation)
    }
    return frozenset(name for of in classes for name in own_sets(of)) - other


def own_sets(of: ast.ClassDef) -> set[str]:
    """Names of a class's attributes and properties that are sets, by annotation or by what is put there."""
    found: set[str] = set()
    for node in ast.walk(of):
        if isinstance(node, ast.AnnAssign) and is_set_type(node.annotation):
            inside = node.target
            if isinstance(inside, ast.Attribute):
                found.add(inside.attr)
            elif isinstance(inside, ast.Name) and node in of.body:
                found.add(inside.id)
        elif isinstance(node, ast.FunctionDef) and node.decorator_list and is_set_type(node.returns):
            found.add(node.name)
        elif isinstance(node, ast.Assign) and _is_made_set(node.value):
            found.update(one.attr for one in node.targets if isinstance(one, ast.Attribute))
    return found


def _is_made_set(node: ast.expr) -> bool:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return node.func.id in {"set", "frozenset"}
    return isinstance(node, ast.Set | ast.SetComp)


def is_set_type(note: ast.expr | None) -> bool:
    """Whether an annotation says a set, perhaps among other types."""
    if isinstance(note, ast.Subscript):
        note = note.value
    if isinstance(note, ast.BinOp):
        return is_set_type(note.left) or is_set_type(note.right)
    return isinstance(note, ast.Name) and note.id in SET_TYPES
