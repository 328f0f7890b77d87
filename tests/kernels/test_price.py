"""Which form of a kernel runs: decided by its price and by what was spent, never by the clock."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from lampyris.api import plan
from lampyris.kernels import _jit, kept_code
from lampyris.kernels._jit import PATH, Kernel, kernel
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from reference.kernel_forms import use


def add(values: Any, marks: Any, at: Any) -> Any:
    for k in range(len(marks)):
        values[at + k] = marks[k] + 1
    return at


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a fresh process; kernels of these tests are nobody else's."""
    monkeypatch.setattr(_jit, "_spent", 0)
    monkeypatch.setattr(_jit, "KERNELS", [])
    monkeypatch.setattr(kept_code, "is_loaded", lambda: False)
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)


def _forms(k: Kernel, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Which form every call from here on runs in; nothing is compiled."""
    ran: list[str] = []
    monkeypatch.setattr(k, "run_plain", lambda *args: ran.append("plain"))

    def compiled() -> Any:
        k._compiled = lambda *args: ran.append("compiled")
        return k._compiled

    monkeypatch.setattr(k, "compiled", compiled)
    return ran


def test_prices() -> None:
    values, marks = np.zeros(10_000), np.zeros(50)
    assert kernel()(add).price((values, marks, 3)) == 500 * 10_000
    assert kernel(each=7)(add).price((values, marks, 3)) == 7 * 10_000
    assert kernel(each=7, of="marks")(add).price((values, marks, 3)) == 7 * 50
    assert kernel(each=7, of=PATH)(add).price((values, marks, 3)) == 7 * 100
    assert kernel()(add).price((1, 2, 3)) == 500


def test_before_numba_is_there_all_kernels_share_one_purse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    price = _jit.PLAIN_NS // 4
    one, other = (kernel(each=price, of="marks")(add) for _ in range(2))
    call = (np.zeros(9), np.zeros(1), 0)
    first, second = _forms(one, monkeypatch), _forms(other, monkeypatch)
    for _ in range(3):
        one(*call)
    other(*call)
    assert (first, second) == (["plain"] * 3, ["plain"])
    other(*call)  # the purse is empty, anyone who asks
    one(*call)
    assert (first[-1], second[-1]) == ("compiled", "compiled")


def test_where_machine_code_is_kept_less_is_spent_before_it_is_loaded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    kept, other = (kernel(each=_jit.KEPT_NS // 2, of="marks")(add) for _ in range(2))
    monkeypatch.setattr(kept, "_kept", True)
    call = (np.zeros(9), np.zeros(1), 0)
    first, second = _forms(kept, monkeypatch), _forms(other, monkeypatch)
    for _ in range(3):
        kept(*call)
        other(*call)
    assert first == ["plain", "compiled", "compiled"]
    assert second == ["plain"] * 3


def test_each_kernel_whose_machine_code_is_kept_has_a_small_purse_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    monkeypatch.setattr(kept_code, "is_loaded", lambda: True)
    kept, other = (kernel(each=_jit.OWN_KEPT_NS // 2, of="marks")(add) for _ in range(2))
    monkeypatch.setattr(kept, "_kept", True)
    call = (np.zeros(9), np.zeros(1), 0)
    first, second = _forms(kept, monkeypatch), _forms(other, monkeypatch)
    for _ in range(3):
        kept(*call)
        other(*call)
    assert first == ["plain", "plain", "compiled"]
    assert second == ["plain"] * 3


def test_once_numba_is_there_each_has_a_purse_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", ModuleType("numba"))
    dear, cheap = (kernel(each=e, of="marks")(add) for e in (_jit.OWN_NS + 1, _jit.OWN_NS // 2))
    slow_to_load = kernel(each=_jit.OWN_NS + 1, load=2, of="marks")(add)
    call = (np.zeros(9), np.zeros(1), 0)
    first, second = _forms(dear, monkeypatch), _forms(cheap, monkeypatch)
    third = _forms(slow_to_load, monkeypatch)
    for _ in range(3):
        dear(*call)
        cheap(*call)
        slow_to_load(*call)
    assert first == ["compiled"] * 3
    assert second == ["plain", "plain", "compiled"]
    assert third == ["plain", "compiled", "compiled"]


def test_plain_always_if_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    k = kernel(each=10**12)(add)
    ran = _forms(k, monkeypatch)
    k(np.zeros(9), np.zeros(1), 0)
    assert ran == ["plain"]


def test_large_arrays_of_a_sparse_kernel_are_read_in_place() -> None:
    k = kernel(out=("values",), of="marks")(add)
    values = np.zeros(2 * _jit.VIEWED, dtype=np.int32)
    marks = np.array([4, 5])
    marks.setflags(write=False)
    seen: list[Any] = []
    k._linked = lambda *args: seen.extend(args) or add(*args)
    assert k.run_plain(values, marks, 7) == 7
    assert isinstance(seen[0], memoryview)
    assert isinstance(seen[1], list)
    assert values[7:9].tolist() == [5, 6]
    assert values.sum() == 11


@pytest.mark.commit(2)
@pytest.mark.parametrize("planner", ["ad-gso", "jps", "theta-star", "dstar-lite", "fastest", "sipp"])
def test_ways_on_a_map_large_enough_for_views(planner: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both forms, the same plan: here sparse kernels read arrays in place, elsewhere in the tests lists."""
    blocked = np.random.default_rng(11).random((80, 90)) < 0.25
    blocked[:4, :4] = blocked[-4:, -4:] = False
    scene = Scene(Grid(blocked), (0, 0), (89, 79))
    found = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        made = plan(scene, planner)
        assert made.path is not None
        found[form] = (made.path.cells.tobytes(), made.cost, made.iterations, made.expansions)
    assert found["plain"] == found["compiled"]
