"""The rules of tools/lint_determinism.py: what an expression must not be in code that decides."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field

from determinism_names import (
    LAWS,
    LISTING_METHODS,
    LISTINGS,
    MODULES,
    OURS,
    STREAMS,
    SUMS,
    banned,
    banned_builtin,
)
from determinism_sets import is_set_type, own_sets

SET_METHODS = frozenset({"union", "intersection", "difference", "symmetric_difference", "copy"})
ORDERED = frozenset(
    {"list", "tuple", "iter", "enumerate", "zip", "map", "filter", "reversed", "next", "dict"}
)
ORDERED_CALLS = frozenset({"dict.fromkeys", "numpy.array", "numpy.fromiter", "itertools.chain", "sum"})


_LIBM = ("goes through the system's libm", "from .random() or .integers()")
_UNSTABLE = "equal ones come as the machine's vector width likes"


@dataclass(frozen=True, order=True)
class Finding:
    """One place that breaks a rule."""

    file: str
    line: int
    rule: str
    what: str
    why: str
    instead: str
    last: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.rule}: {self.what}; {self.why}; instead: {self.instead}"


@dataclass
class _Scope:
    """What is known of the names of one function, or of the module."""

    sets: set[str] = field(default_factory=set)
    whole: set[str] = field(default_factory=set)
    bound: set[str] = field(default_factory=set)


class Reader(ast.NodeVisitor):
    """Walks one module and gathers findings."""

    def __init__(self, file: str, attributes: frozenset[str]) -> None:
        self.file = file
        self.found: list[Finding] = []
        self._attributes = attributes
        self._from: dict[str, str] = {}
        self._scopes = [_Scope()]
        self._makers: set[str] = set()
        self._in_order: set[int] = set()
        self._asked: set[int] = set()
        self._base: set[int] = set()
        self._own: list[set[str]] = [set()]

    def read(self, tree: ast.Module) -> list[Finding]:
        """All findings of a module, exceptions not yet taken off."""
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and is_set_type(node.returns):
                self._makers.add(node.name)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                self._from |= _imported(node)
        self._learn(tree)
        self.visit(tree)
        return self.found

    # What names mean

    def _name(self, node: ast.expr) -> str:
        """Dotted name with its import resolved: ``np.exp`` is ``numpy.exp``."""
        if isinstance(node, ast.Name):
            return self._from.get(node.id, node.id)
        if isinstance(node, ast.Attribute):
            return f"{self._name(node.value)}.{node.attr}"
        return ""

    def _learn(self, scope: ast.AST) -> None:
        """Names of a scope that hold sets or whole numbers, by annotation or by what is put there."""
        known = self._scopes[-1]
        unsure: set[str] = set()
        for node in _own(scope):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                known.bound.add(node.id)
            if isinstance(node, ast.arg):
                known.bound.add(node.arg)
                self._note(node.arg, node.annotation)
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                self._note(node.target.id, node.annotation)
            elif isinstance(node, ast.Assign):
                for target in (one for one in node.targets if isinstance(one, ast.Name)):
                    if self._is_set(node.value):
                        known.sets.add(target.id)
                    (known.whole if self._is_whole(node.value) else unsure).add(target.id)
            elif isinstance(node, ast.For | ast.comprehension) and isinstance(node.target, ast.Name):
                counted = isinstance(node.iter, ast.Call) and self._name(node.iter.func) == "range"
                (known.whole if counted else unsure).add(node.target.id)
        known.whole -= unsure

    def _note(self, name: str, note: ast.expr | None) -> None:
        if is_set_type(note):
            self._scopes[-1].sets.add(name)
        if isinstance(note, ast.Name) and note.id == "int":
            self._scopes[-1].whole.add(name)

    def _is_set(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Set | ast.SetComp):
            return True
        if isinstance(node, ast.Name):
            return any(node.id in scope.sets for scope in self._scopes)
        if isinstance(node, ast.Attribute):
            own = isinstance(node.value, ast.Name) and node.value.id == "self"
            return node.attr in self._attributes or (own and node.attr in self._own[-1])
        if isinstance(node, ast.BinOp):
            return isinstance(node.op, ast.BitOr | ast.BitAnd | ast.Sub | ast.BitXor) and (
                self._is_set(node.left) or self._is_set(node.right)
            )
        if isinstance(node, ast.IfExp):
            return self._is_set(node.body) or self._is_set(node.orelse)
        if isinstance(node, ast.Call):
            name = self._name(node.func)
            if name in {"set", "frozenset"} or name.rpartition(".")[2] in self._makers:
                return True
            return (
                isinstance(node.func, ast.Attribute)
                and node.func.attr in SET_METHODS
                and self._is_set(node.func.value)
            )
        return False

    def _is_whole(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Constant):
            return isinstance(node.value, int)
        if isinstance(node, ast.Name):
            return any(node.id in scope.whole for scope in self._scopes)
        if isinstance(node, ast.BinOp):
            sides = self._is_whole(node.left) and self._is_whole(node.right)
            return sides and not isinstance(node.op, ast.Div)
        if isinstance(node, ast.UnaryOp):
            return self._is_whole(node.operand)
        if isinstance(node, ast.Call):
            name = self._name(node.func)
            inside = name in {"abs", "max", "min"} and all(self._is_whole(one) for one in node.args)
            return inside or (name in {"len", "int", "math.isqrt", "round"} and len(node.args) == 1)
        return False

    def _is_counting(self, node: ast.expr) -> bool:
        """Whether what is summed is whole numbers for certain: yes and no, lengths, a shape."""
        if isinstance(node, ast.GeneratorExp | ast.ListComp):
            one = node.elt
            sides = [one.body, one.orelse] if isinstance(one, ast.IfExp) else [one]
            return all(self._is_whole(side) or self._is_yes_or_no(side) for side in sides)
        return isinstance(node, ast.Attribute) and node.attr == "shape"

    def _is_yes_or_no(self, node: ast.expr) -> bool:
        if isinstance(node, ast.BoolOp):
            return all(self._is_yes_or_no(one) for one in node.values)
        if isinstance(node, ast.UnaryOp):
            return isinstance(node.op, ast.Not)
        asked = isinstance(node, ast.Call) and self._name(node.func) in {"bool", "any", "all", "isinstance"}
        return isinstance(node, ast.Compare) or asked

    # What breaks a rule

    def _tell(self, node: ast.AST, rule: str, what: str, why: str, instead: str) -> None:
        first, last = getattr(node, "lineno", 0), getattr(node, "end_lineno", 0)
        self.found.append(Finding(self.file, first, rule, what, why, instead, last))

    def visit_Import(self, node: ast.Import) -> None:
        for one in node.names:
            self._module(node, one.name)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        self._module(node, node.module or "")

    def _module(self, node: ast.AST, name: str) -> None:
        root = name.partition(".")[0]
        if root in {"random", "secrets"}:
            self._tell(
                node, "random", f"import {name}", "its state is shared and not ours", "Generator(PCG64(...))"
            )
        elif root == "scipy":
            self._tell(
                node, "scipy", name, "compiled elsewhere, bits not promised", "our own, or whole numbers"
            )
        elif root == "cmath":
            self._tell(node, "bits", "cmath", "rounded as the system likes", OURS)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self._own.append(own_sets(node))
        self.generic_visit(node)
        self._own.pop()

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self._scopes.append(_Scope())
        self._learn(node)
        self.generic_visit(node)
        self._scopes.pop()

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if isinstance(node.op, ast.MatMult):
            self._tell(node, "bits", "@", "the order of BLAS's sums is the machine's", SUMS)
        elif isinstance(node.op, ast.Pow):
            down = isinstance(node.right, ast.UnaryOp)
            if down or not (self._is_whole(node.left) and self._is_whole(node.right)):
                said = ast.unparse(node)
                self._tell(node, "bits", said, "pow rounds as the system likes", "x * x, or whole numbers")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self.visit_BinOp(ast.copy_location(ast.BinOp(_read(node.target), node.op, node.value), node))

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, complex):
            self._tell(node, "bits", "a complex number", "products of these may be fused", "two floats")

    def visit_For(self, node: ast.For) -> None:
        self._ordered(node.iter, "for")
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        if id(node) not in self._in_order:
            self._ordered(node.iter, "for")
        self.generic_visit(node)

    def visit_SetComp(self, node: ast.SetComp) -> None:
        # A set made of a set: no order goes in, none comes out.
        self._in_order.update(id(one) for one in node.generators)
        self.generic_visit(node)

    def visit_Starred(self, node: ast.Starred) -> None:
        if id(node) not in self._in_order:
            self._ordered(node.value, "*")
        self.generic_visit(node)

    def visit_Set(self, node: ast.Set) -> None:
        for one in node.elts:
            self._in_order.update({id(one), id(getattr(one, "value", one))})
        self.generic_visit(node)

    def _ordered(self, node: ast.expr, by: str) -> None:
        if self._is_set(node):
            said = f"{by} {ast.unparse(node)}"
            self._tell(node, "order", said, "a set has no order", "sorted(...), or a dict with None")

    # What is read, called or not

    def visit_Name(self, node: ast.Name) -> None:
        if isinstance(node.ctx, ast.Load) and id(node) not in self._asked:
            bound = any(node.id in scope.bound for scope in self._scopes)
            if node.id in self._from:
                self._handed_on(node)
            elif not bound and (told := banned_builtin(node.id)):
                self._tell(node, *told)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if isinstance(node.ctx, ast.Load) and id(node) not in self._asked:
            self._handed_on(node)
        # Of a module something is read here, not the module; what was told of the whole is not told again.
        told = _root(node) in self._from and banned(self._name(node))
        (self._asked if told else self._base).add(id(node.value))
        self.generic_visit(node)

    def _handed_on(self, node: ast.Name | ast.Attribute) -> None:
        """A function that is not called here, but by whom it is given to."""
        name = self._name(node)
        known = _root(node) in self._from
        if known and (told := banned(name)):
            self._tell(node, *told)
        elif known and name in MODULES and id(node) not in self._base:
            self._tell(node, "alias", name, "what is read of it cannot be told", "its own name")
        elif known and name in LISTINGS:
            self._tell(node, "order", name, "the file system's order", "sorted(...) of it")
        elif isinstance(node, ast.Attribute) and not known:
            self._method_handed_on(node, name)

    def _method_handed_on(self, node: ast.Attribute, name: str) -> None:
        of = name.split(".")[-2].lstrip("_") if "." in name else ""
        if node.attr == "dot":
            self._tell(node, "bits", ".dot", "the order of BLAS's sums is the machine's", SUMS)
        elif node.attr in LAWS and of == "rng":
            self._tell(node, "random", f".{node.attr}", *_LIBM)
        elif node.attr in {"argsort", "argpartition"}:
            self._tell(node, "order", node.attr, _UNSTABLE, 'kind="stable"')
        elif node.attr in LISTING_METHODS:
            self._tell(node, "order", node.attr, "the file system's order", "sorted(...) of it")

    def visit_Call(self, node: ast.Call) -> None:
        name = self._name(node.func)
        method = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        by_key = name == "sorted" and any(word.arg in {"key", None} for word in node.keywords)
        if name in {"sorted", "set", "frozenset", "any", "all", "len"} and not by_key:
            for one in node.args:  # Sorted, or asked in a way that no order shows.
                self._in_order.add(id(one))
                if isinstance(one, ast.GeneratorExp | ast.ListComp):
                    self._in_order.update(id(inner) for inner in one.generators)
                    self._in_order.update(id(inner.iter) for inner in one.generators)
        self._asked.add(id(node.func))
        told = banned(name)
        if told is not None:
            self._tell(node, *told)
        self._of_numbers(node, name, method)
        self._of_chance(node, name, method)
        self._of_order(node, name, method)
        if name == "getattr" and len(node.args) > 1 and isinstance(node.args[1], ast.Constant):
            self._base.add(id(node.args[0]))
            if told := banned(f"{self._name(node.args[0])}.{node.args[1].value}"):
                self._tell(node, *told)
        if by_key:  # Those with the same key stay as they came.
            for one in node.args[:1]:
                self._ordered(one, "sorted(key=)")
        self.generic_visit(node)

    def _of_numbers(self, node: ast.Call, name: str, method: str) -> None:
        root = name.rpartition(".")[0]
        if name == "pow" and len(node.args) == 2:
            self._tell(node, "bits", name, "pow rounds as the system likes", "x * x, or whole numbers")
        elif name == "sum" and not (node.args and self._is_counting(node.args[0])):
            why = "from Python 3.12 on it carries what rounding loses"
            self._tell(node, "sum", f"{name}() of numbers that may be floats", why, "math.fsum, or a loop")
        elif method == "dot" and root != "numpy":
            self._tell(node, "bits", ".dot()", "the order of BLAS's sums is the machine's", SUMS)
        elif name == "numpy.arange" and any(_is_float(one) for one in node.args):
            self._tell(
                node, "bits", "np.arange of floats", "start + i * step may be fused", "np.arange(n) * step"
            )
        for word in node.keywords:
            if word.arg in {"fastmath", "parallel"} and not _is_false(word.value):
                self._tell(node, "bits", f"{word.arg}=", "sums are taken in another order", "leave it out")

    def _of_chance(self, node: ast.Call, name: str, method: str) -> None:
        if (
            method in LAWS
            and isinstance(node.func, ast.Attribute)
            and not name.startswith(("numpy.", "math."))
        ):
            self._tell(node, "random", f".{method}()", *_LIBM)
        elif name in {f"numpy.random.{one}" for one in STREAMS} and not node.args and not node.keywords:
            self._tell(node, "random", name, "no seed", "Generator(PCG64(SeedSequence(...)))")
        elif name in {"hash", "id"}:
            self._tell(
                node, "order", f"{name}()", "another in each process", "a key of its own, or zlib.crc32"
            )

    def _of_order(self, node: ast.Call, name: str, method: str) -> None:
        listing = name in LISTINGS or method in LISTING_METHODS
        if listing and id(node) not in self._in_order:
            self._tell(node, "order", name or method, "the file system's order", "sorted(...) of it")
        sorts = method in {"argsort", "argpartition"} or name == "numpy.partition"
        if sorts and not _is_stable(node):
            self._tell(node, "order", method, _UNSTABLE, 'kind="stable"')
        if name in ORDERED or name in ORDERED_CALLS or method in {"join", "extend"}:
            for one in node.args:
                self._ordered(one, f"{name or method}()")
        if method == "pop" and not node.args and isinstance(node.func, ast.Attribute):
            self._ordered(node.func.value, "pop()")
        if name in {"min", "max"} and any(word.arg == "key" for word in node.keywords):
            for one in node.args[:1]:
                self._ordered(one, f"{name}(key=)")


def _own(scope: ast.AST) -> Iterator[ast.AST]:
    """Nodes of a scope without those of the functions within it; its own arguments with it."""
    if isinstance(scope, ast.FunctionDef | ast.AsyncFunctionDef):
        arguments = scope.args
        yield from (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
    left = list(ast.iter_child_nodes(scope))[::-1]
    apart = ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.arguments
    while left:
        node = left.pop()
        if not isinstance(node, apart):
            yield node
            left += list(ast.iter_child_nodes(node))[::-1]


def _imported(node: ast.Import | ast.ImportFrom) -> dict[str, str]:
    """What the names that an import binds stand for."""
    if isinstance(node, ast.ImportFrom):
        return {one.asname or one.name: f"{node.module}.{one.name}" for one in node.names}
    heads = {one.name.partition(".")[0] for one in node.names if not one.asname}
    return {one.asname: one.name for one in node.names if one.asname} | {head: head for head in heads}


def _root(node: ast.expr) -> str:
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _read(node: ast.expr) -> ast.expr:
    return ast.parse(ast.unparse(node), mode="eval").body


def _is_float(node: ast.expr) -> bool:
    return any(isinstance(one, ast.Constant) and isinstance(one.value, float) for one in ast.walk(node))


def _is_false(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is False


def _is_stable(node: ast.Call) -> bool:
    return any(
        w.arg == "kind" and isinstance(w.value, ast.Constant) and w.value.value == "stable"
        for w in node.keywords
    )
