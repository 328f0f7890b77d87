"""Faster compiling by numba, with the same results: repeated look-ups are cached, what no kernel uses is left out.

A kernel is compiled once on a machine, and the first run waits for it. Numba spends a sixth of that time on finding the
implementation of ``+`` or ``a[i]`` for given types, again for each place in the source and each round of type inference.
Another twentieth it spends, after each pass, on finding the variables that are live at the entry of each block; only
generators and object mode use them. It asks LLVM for the size of the same few types at each access of an array.

What kernels call is compiled for them alone: it is lowered and linked into its caller, and optimised there, in its place. Numba
would optimise it by itself, make machine code of it that nothing runs, and then do both again within each caller: half of
the time that LLVM takes.

An element of an array is a few instructions of LLVM's. Numba writes ten times as many, of which LLVM's optimisation leaves
those few; here they are written directly. Functions are optimised only within the kernel, not each by itself before. Both may
lead to other machine code, with the same results: no operation on floating-point numbers is reordered or merged, as no
``fastmath`` is in use.

Each shortcut saves about 2 % or more of what compiling :func:`.sampling.batch.search_batch` takes. Of the calls of Python
functions: remembered implementations 40 %, the work after a pass and elements that are read 9 % each, variables in order 7 %,
conversions and elements that are written 4 % each, sizes 3 %, the log, types of values and linking 2 % each. Linking, and fewer
optimisations, also save half of LLVM's time.

All this applies within :func:`shortcuts` alone, in the thread that is in it. Other code that a program compiles is compiled as
always.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from types import BuiltinFunctionType
from typing import Any

RUN = (
    "transforms", "canonicalize_cfg", "func_ir", "blocks", "VariableLifetime", "variable_lifetime", "analysis",
    "compute_live_variables", "cfg", "usedefs", "defmap", "deadmaps", "combined", "items", "block_entry_vars",
    "is_generator", "GeneratorInfo", "generator_info", "_compute_generator_info", "_insert_var_dels",
)  # fmt: skip
"""What numba's ``PostProcessor.run`` refers to, in versions whose work is known here."""


FINALIZE = (
    "require_global_compiler_lock", "_codegen", "_check_llvm_bugs", "_raise_if_finalized", "config", "DUMP_FUNC_OPT",
    "dump", "name", "get_llvm_str", "set", "_linking_libraries", "_reload_init", "update", "add", "_final_module",
    "link_in", "_get_module_for_linking", "_optimize_final_module", "verify", "_finalize_final_module",
)  # fmt: skip
"""The same of ``CPUCodeLibrary.finalize``."""
FUNCTIONS = (
    "_codegen", "_data_layout", "data_layout", "functions", "_function_pass_manager", "name", "_recorded_timings", "record",
    "run",
)  # fmt: skip
"""The same of ``CPUCodeLibrary._optimize_functions``."""
OWN = ("builtins", "_operator", "math")
"""Python's modules with functions that kernels call, and operators."""
PART = "_part"
"""How the names of functions end that only kernels call."""


class _Ours(threading.local):
    depth = 0
    thorough = False


_ours = _Ours()


@contextmanager
def shortcuts(*, thorough: bool = False) -> Iterator[None]:
    """Use the shortcuts for what this thread compiles inside."""
    _install()
    if not _ours.depth:
        _ours.thorough = thorough
    _ours.depth += 1
    try:
        yield
    finally:
        _ours.depth -= 1


@cache
def _install() -> None:
    """Put the shortcuts in place, where this version of numba has what they rely on."""
    from llvmlite import binding  # type: ignore[import-untyped]
    from numba.core import base, codegen, cpu, ir, lowering, postproc, ssa, transforms, types
    from numba.core.typing import context

    shorter: tuple[tuple[Any, str, Callable[..., Any]], ...] = (
        (types.Function, "get_call_type", _remembered),
        (base.BaseContext, "get_abi_sizeof", _sizes),
        (lowering.Lower, "lower_getitem", lambda whole: _read_at_once(whole, types)),
        (lowering.Lower, "lower_setitem", lambda whole: _written_at_once(whole, types)),
        (postproc.PostProcessor, "run", lambda whole: _without_entries(whole, transforms, postproc)),
        (context.BaseContext, "resolve_value_type", lambda whole: _classes(whole, types)),
        (context.BaseContext, "_resolve_user_function_type", lambda whole: _conversions(whole, types)),
        (ssa, "_run_ssa_block_pass", lambda whole: _without_a_log(whole, ir.Assign)),
        (ir.Inst, "_rec_list_vars", lambda whole: _variables(whole, ir.Var, ir.Inst)),
        (codegen.CPUCodeLibrary, "_optimize_functions", lambda whole: _registers_alone(whole, binding)),
        (codegen.CPUCodeLibrary, "finalize", _linked_alone),
        (cpu.CPUContext, "get_executable", _unless_a_part),
    )
    known = {"run": RUN, "_optimize_functions": FUNCTIONS, "finalize": FINALIZE}
    if codegen.CPUCodeLibrary.finalize.__code__.co_names != FINALIZE:
        shorter = shorter[:-2]
    for owner, name, wrap in shorter:
        whole = getattr(owner, name, None)  # another version of numba may have another
        if whole is None or whole.__code__.co_names != known.get(name, whole.__code__.co_names):
            continue
        if name == "get_call_type" and "_impl_keys" not in whole.__code__.co_names:
            continue
        setattr(owner, name, wrap(whole))


def _remembered(resolve: Callable[..., Any]) -> Callable[..., Any]:
    """Resolve each function of numba's own for given types of arguments once.

    Numba notes with the function which implementation the last caller got, and takes that when it makes machine code: where
    a user's function was compiled meanwhile with ``fastmath``, that is one with ``fastmath``. So ours is noted again.
    """
    known: dict[tuple[Any, ...], tuple[Any, Any]] = {}

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws or not _ours.depth:
            return resolve(self, context, args, kws)
        key = (self, context, tuple(args))
        if key in known:
            found, implementation = known[key]
            self._impl_keys[found.args] = implementation
            return found
        found = resolve(self, context, args, kws)
        if found is not None:
            known[key] = found, self._impl_keys[found.args]
        return found

    return get_call_type


def _classes(whole: Callable[[Any, Any], Any], types: Any) -> Callable[[Any, Any], Any]:
    """The type of ``numpy.uint64`` and of others like it, which kernels refer to at each index; and that of Python's own
    functions, which numba looks for among all other values first."""
    known: dict[Any, Any] = {}

    def resolve_value_type(self: Any, val: Any) -> Any:
        if not _ours.depth or not isinstance(val, (type, BuiltinFunctionType)):
            return whole(self, val)
        found = known.get(val) if isinstance(val, type) else None
        if found is None and val.__module__ in OWN:
            found = self._get_global_type(val)
        if found is None:
            found = whole(self, val)
            if isinstance(found, types.NumberClass):
                known[val] = found
        return found

    return resolve_value_type


def _conversions(whole: Callable[..., Any], types: Any) -> Callable[..., Any]:
    """What comes of ``numpy.uint64(i)`` for given types of ``i``, asked for once."""
    known: dict[tuple[Any, Any], Any] = {}

    def _resolve_user_function_type(self: Any, func: Any, args: Any, kws: Any, literals: Any = None) -> Any:
        if not _ours.depth or kws or literals is not None or not isinstance(func, types.NumberClass):
            return whole(self, func, args, kws, literals)
        key = (func, tuple(args))
        found = known.get(key)
        if found is None:
            found = known[key] = whole(self, func, args, kws, literals)
        return found

    return _resolve_user_function_type


def _without_a_log(whole: Callable[..., Any], assignment: type) -> Callable[..., Any]:
    """Each statement of a block as a handler changes it; numba also writes three lines about each to its log."""

    def _run_ssa_block_pass(states: Any, blk: Any, handler: Any) -> Iterator[Any]:
        if not _ours.depth:
            yield from whole(states, blk, handler)
            return
        for statement in blk.body:
            change = handler.on_assign if isinstance(statement, assignment) else handler.on_other
            yield change(states, statement)

    return _run_ssa_block_pass


def _sizes(measure: Callable[[Any, Any], int]) -> Callable[[Any, Any], int]:
    """The size of a type of LLVM's, asked for once for each target: numba copies its context for each function that it compiles,
    and what is kept here must not keep all the copies."""
    known: dict[tuple[Any, str], int] = {}

    def get_abi_sizeof(self: Any, kind: Any) -> int:
        if not _ours.depth:
            return measure(self, kind)
        key = (self.codegen(), str(kind))
        if key not in known:
            known[key] = measure(self, kind)
        return known[key]

    return get_abi_sizeof


def _is_flat(lower: Any, signature: Any, types: Any) -> bool:
    """Whether it is an element of a one-dimensional array of numbers that is meant, by an index of 64 bits."""
    array, index = signature.args[:2]
    return bool(
        _ours.depth
        and not lower.context.enable_boundscheck
        and isinstance(array, types.Array)
        and array.ndim == 1
        and array.layout == "C"
        and array.aligned
        and isinstance(array.dtype, (types.Integer, types.Float, types.Boolean))
        and isinstance(index, types.Integer)
        and index.bitwidth == 64
    )


def _place(lower: Any, kind: Any, array: Any, index_kind: Any, index: Any) -> Any:
    """Where an element lies. Numba takes the array apart into its seven fields for each, which makes half of the instructions
    that LLVM reads."""
    build, model = lower.builder, lower.context.data_model_manager[kind]
    data = build.extract_value(array, model.get_field_position("data"))
    if index_kind.signed:
        size = build.extract_value(array, [model.get_field_position("shape"), 0])
        negative = build.icmp_signed("<", index, index.type(0))
        index = build.select(negative, build.add(index, size), index)
    return build.gep(data, [index])


def _read_at_once(whole: Callable[..., Any], types: Any) -> Callable[..., Any]:
    def lower_getitem(self: Any, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        if not _is_flat(self, signature, types):
            return whole(self, resty, expr, value, index, signature)
        kind, index_kind = signature.args
        cast, build = self.context.cast, self.builder
        array = self.loadvar(value.name)
        number = cast(build, self.loadvar(index.name), self.typeof(index.name), index_kind)
        found = self.context.unpack_value(build, kind.dtype, _place(self, kind, array, index_kind, number))
        return cast(
            build, cast(build, found, kind.dtype, signature.return_type), signature.return_type, resty
        )

    return lower_getitem


def _written_at_once(whole: Callable[..., Any], types: Any) -> Callable[..., Any]:
    def lower_setitem(self: Any, target_var: Any, index_var: Any, value_var: Any, signature: Any) -> Any:
        if not _is_flat(self, signature, types) or not isinstance(
            signature.args[2], (types.Integer, types.Float, types.Boolean)
        ):
            return whole(self, target_var, index_var, value_var, signature)
        kind, index_kind, value_kind = signature.args
        cast, build = self.context.cast, self.builder
        array, value = self.loadvar(target_var.name), self.loadvar(value_var.name)
        number = cast(build, self.loadvar(index_var.name), self.typeof(index_var.name), index_kind)
        value = cast(
            build, cast(build, value, self.typeof(value_var.name), value_kind), value_kind, kind.dtype
        )
        place = _place(self, kind, array, index_kind, number)
        self.context.pack_value(build, kind.dtype, value, place)
        return None

    return lower_setitem


def _without_entries(whole: Callable[..., Any], transforms: Any, postproc: Any) -> Callable[..., Any]:
    """The work after a pass, without the variables that live at the entry of each block."""

    def run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        code = self.func_ir
        if not _ours.depth or emit_dels or code.is_generator:
            whole(self, emit_dels, extend_lifetimes)
            return
        code.blocks = transforms.canonicalize_cfg(code.blocks)
        code.variable_lifetime = postproc.VariableLifetime(code.blocks)
        code.generator_info = None

    return run


def _variables(
    whole: Callable[[Any, Any], list[Any]], variable: type, instruction: type
) -> Callable[[Any, Any], list[Any]]:
    """The variables of an instruction, in the same order, without a list for each of its attributes."""
    kinds: dict[type, int] = {}

    def kind_of(one: type) -> int:
        groups: tuple[Any, ...] = (variable, instruction, (list, tuple), dict)
        kinds[one] = next((k for k, group in enumerate(groups) if issubclass(one, group)), len(groups))
        return kinds[one]

    def collect(values: Any, found: list[Any]) -> None:
        for value in values:
            kind = kinds.get(type(value))
            if kind is None:
                kind = kind_of(type(value))
            if kind == 0:
                found.append(value)
            elif kind == 1:
                found += value.list_vars()
            elif kind == 2:
                collect(value, found)
            elif kind == 3:
                collect(value.values(), found)

    def _rec_list_vars(self: Any, val: Any) -> list[Any]:
        if not _ours.depth:
            return whole(self, val)
        found: list[Any] = []
        collect((val,), found)
        return found

    return _rec_list_vars


def _registers_alone(whole: Callable[[Any, Any], None], binding: Any) -> Callable[[Any, Any], None]:
    """Of the optimisations of each function by itself only that variables come into registers: the others are all done again
    when it is in its caller, or in the kernel, and take a third of LLVM's time. Not for kernels that are faster with them:
    simulations with SIPP were 12 % slower.
    """

    def _optimize_functions(self: Any, module: Any) -> None:
        if not _ours.depth or _ours.thorough:
            whole(self, module)
            return
        module.data_layout = self._codegen._data_layout
        passes, builder = binding.create_new_function_pass_manager(), self._codegen._pass_builder()
        passes.add_sroa_pass()
        passes.add_simplify_cfg_pass()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    return _optimize_functions


def _is_part(library: Any) -> bool:
    return bool(_ours.depth) and library.name.endswith(PART)


def _linked_alone(whole: Callable[[Any], None]) -> Callable[[Any], None]:
    """What is called within a kernel gets what it calls in turn, and nothing else: callers link it as it is."""

    def finalize(self: Any) -> None:
        if not _is_part(self):
            whole(self)
            return
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    return finalize


def _unless_a_part(make: Callable[..., Any]) -> Callable[..., Any]:
    """Numba knows each function by something callable in C, its own; a part's is never called."""

    def get_executable(self: Any, library: Any, fndesc: Any, env: Any) -> Any:
        if not _is_part(library):
            return make(self, library, fndesc, env)
        library._ensure_finalized()
        return [].copy

    return get_executable
