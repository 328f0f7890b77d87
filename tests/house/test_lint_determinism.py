"""Code that decides has no operation whose last bit or order is the machine's; and the lint would see one."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ROOT / "tools"

pytestmark = pytest.mark.source


@pytest.fixture(scope="module")
def lint() -> ModuleType:
    sys.path.insert(0, str(TOOLS))
    try:
        spec = importlib.util.spec_from_file_location("lint_determinism", TOOLS / "lint_determinism.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(TOOLS))
    return module


def rules(lint: ModuleType, text: str) -> list[tuple[int, str]]:
    return [(one.line, one.rule) for one in lint.lint(text, "sample.py")[0]]


def test_it_looks_at_all_code_that_decides(lint: ModuleType) -> None:
    """That it finds nothing there is said by `make style`."""
    assert len(lint.files()) > 200
    assert [room for room in lint.ROOMS if not (lint.SOURCE / room).exists()] == []


BAD = {
    "bits": [
        "import numpy as np\ny = np.exp(x)",
        "import numpy as np\ny = np.log(x)",
        "import numpy as np\ny = np.power(x, 3)",
        "import numpy as np\ny = np.hypot(x, z)",
        "import numpy as np\ny = np.interp(x, a, b)",
        "import numpy\ny = numpy.arctan2(x, z)",
        "import numpy as np\ny = np.einsum('ij,j', a, b)",
        "import numpy as np\ny = np.linalg.norm(x)",
        "import numpy as np\ny = np.arange(0, x, 0.1)",
        "import math\ny = math.tan(x)",
        "import math\ny = math.dist(x, z)",
        "import math as m\ny = m.pow(x, z)",
        "\nfrom math import sin; y = sin(x)",
        "\nfrom numpy import dot as d; y = d(x, z)",
        "\ny = x @ z",
        "\nx @= z",
        "\ny = x ** 2",
        "\ny = 2.0 ** 3",
        "\ny = 10 ** -3",
        "\nx **= 2",
        "\ny = pow(x, 0.5)",
        "\ny = a.dot(b)",
        "\ny = 1j * x",
        "\nk = numba.njit(fastmath=True)(f)",
        "def f(n: float) -> float:\n    return n ** 2",
        "import numpy as np\ng = np.exp; y = g(x)",
        "import numpy as np\ny = list(map(np.exp, a))",
        "import numpy as np\ny = np.vectorize(np.sin)(x)",
        "import numpy as np\ny = np.exp.__call__(x)",
        "import numpy as np\ny = getattr(np, 'exp')(x)",
        "import numpy as np\nn = np.linalg.norm",
        "import functools, math\ny = functools.reduce(math.hypot, a)",
        "import operator\ny = map(operator.pow, a, b)",
        "\nfrom math import sin; y = map(sin, a)",
        "def f(x): return sin(x)\ny = [sin, f]\nfrom math import sin",
        "\ny = map(pow, a, b)",
        "def f(pow): ...\ny = map(pow, a, b)",
        "\ny = map(a.dot, b)",
        "\ny = (i / 2) ** 2",
    ],
    "sum": [
        "\ny = list(map(sum, x))",
        "\ny = sum(x)",
        "\ny = sum(a * b for a in x)",
        "\ny = sum([len(a) / 2 for a in x])",
        "\ny = sum(1 if a else b for a in x)",
    ],
    "random": [
        "\nimport random",
        "\nfrom random import choice",
        "import numpy as np\ny = np.random.rand(3)",
        "import numpy as np\nnp.random.seed(3)",
        "import numpy as np\nr = np.random.default_rng()",
        "import numpy as np\nr = np.random.default_rng(3)",
        "import numpy as np\nr = np.random.PCG64()",
        "\ny = rng.normal(0, 1, 3)",
        "\ny = rng.uniform(-1, 1)",
        "import os\nx = os.urandom(8)",
        "import os\nx = map(os.urandom, [8])",
        "import numpy as np\nr = map(np.random.default_rng, seeds)",
        "\ny = map(rng.normal, x)",
        "class A:\n    y = field(self._rng.uniform)",
    ],
    "time": [
        "import time\nif time.monotonic() > end: stop()",
        "\nfrom time import perf_counter; t = perf_counter()",
        "\nfrom lampyris.kernels import loading; t = loading.wall()",
        "\nfrom lampyris.kernels.loading import cpu; t = cpu()",
        "import datetime\nt = datetime.datetime.now()",
        "import time as t\nclock = t.monotonic",
        "import time as t\ndef f(clock=t.monotonic): ...\n\n",
        "\nfrom time import monotonic; f(clock=monotonic)",
    ],
    "alias": [
        "import numpy as np\nm = np; y = m.exp(x)",
        "import math\ny = getattr(math, name)(x)",
        "import numpy as np\nr = np.random; y = r.rand(3)",
    ],
    "scipy": ["\nimport scipy.ndimage", "\nfrom scipy.stats import rankdata"],
    "order": [
        "\nfor x in {1, 2}: pass",
        "s = set(y)\nfor x in s: pass",
        "s: set[int] = y\nz = [x for x in s]",
        "def f(s: frozenset[str]) -> None:\n    return list(s)",
        "def f(s: set[str] | None) -> None:\n    return tuple(s)",
        "def f() -> set[int]: ...\nz = {x: 1 for x in f()}",
        "class A:\n    s: set[int]\n    def f(self): return max(self.s, key=abs)",
        "class A:\n    def f(self): self.s = frozenset(y); return [*self.s]",
        "class A:\n    def __init__(self): self.s: set[int] = x\n    def f(self): return list(self.s)",
        "class A:\n    @property\n    def s(self) -> set[int]: ...\n\n\ndef f(a): return [x for x in a.s]",
        "class A:\n    s: list[int]\nclass B:\n    s: set[int]\n    def f(self): return list(self.s)",
        "s = set(y)\nz = [*s, 1]",
        "s = set(y)\nz = ','.join(s)",
        "s = set(y) | t\nz = s.pop()",
        "s = set(y)\nz = dict.fromkeys(s)",
        "s = set(y)\nz = next(iter(s.union(t)))",
        "import os\nz = os.listdir(p)",
        "\nz = list(path.glob('*.py'))",
        "\nz = [p for p in path.iterdir()]",
        "\nk = hash(x)",
        "\nk = id(x)",
        "\nk = sorted(x, key=id)",
        "s = set(y)\nz = sorted(s, key=abs)",
        "s = set(y)\nz = sorted(s, **how)",
        "s = set(y)\nz = sorted((x for x in s), key=abs)",
        "\nz = sorted(path.glob('*.py'), key=len)",
        "import os\nz = map(os.listdir, paths)",
        "\nz = map(path.glob, words)",
        "\nz = map(x.argsort, y)",
        "import numpy as np\nk = np.argsort(x)",
        "\nk = x.argsort(kind='quicksort')",
        "import numpy as np\nk = np.argpartition(x, 3)",
        "import numpy as np\nk = np.partition(x, 3)",
    ],
}


@pytest.mark.parametrize(("rule", "text"), [(rule, text) for rule, texts in BAD.items() for text in texts])
def test_each_rule_finds_its_sample(lint: ModuleType, rule: str, text: str) -> None:
    lines = {line for line, found in rules(lint, text) if found == rule}
    assert lines & {2, 3, 5, 6}, text


GOOD = [
    "import math\ny = math.sqrt(x * x + z * z)",
    "import numpy as np\ny = np.sqrt(np.square(x)) + abs(z)",
    "n = 2**64 - 1",
    "def f(n: int) -> int:\n    return n**2",
    "z = [10**k for k in range(3)]",
    "import numpy as np\nr = np.random.Generator(np.random.PCG64(np.random.SeedSequence(1)))\nr.random(3)",
    "from lampyris._core import elementary\ny = elementary.exp(x)",
    "s = set(y)\nz = sorted(s)\nn = len(s)\nb = 3 in s\na = any(x > 1 for x in s)",
    "s = set(y)\nz = {x + 1 for x in s}",
    "s = dict.fromkeys(y)\nfor x in s: pass",
    "class A:\n    s: list[int]\nclass B:\n    s: set[int]\ndef f(a): return list(a.s)",
    "import os\nz = sorted(n for n in os.listdir(p) if n)",
    "z = sorted({*path.glob('*.py'), *other.glob('*.py')})",
    "import numpy as np\nk = np.argsort(x, kind='stable')",
    "head, _, tail = word.partition(by)",
    "import numpy as np\nz = np.arange(n) * 0.1",
    "import math\nz = math.fsum(x) + x.sum() + float(np.sum(x))",
    "n = sum(a > b for a in x) + sum(len(a) for a in x) + sum(1 for a in x) + sum(not a for a in x)",
    "s = set(y)\nz = sorted(sorted(s), key=abs)",
    "import os\nz = getattr(os, 'O_BINARY', 0) | os.O_RDONLY",
    "import numpy as np\nz = map(np.sqrt, x)\nr: np.random.Generator = y\nw = np.float64",
    "import numpy as np\ntry: f()\nexcept np.linalg.LinAlgError: pass",
    "def f(id, sum, law):\n    return id + sum + law.gamma",
    "n = sum(grid.shape) + sum(a in b and bool(c) for a in x)",
]


@pytest.mark.parametrize("text", GOOD)
def test_what_is_defined_everywhere_is_let_through(lint: ModuleType, text: str) -> None:
    assert rules(lint, text) == []


def test_an_exception_needs_a_reason_and_something_to_excuse(lint: ModuleType) -> None:
    assert rules(lint, "y = x @ z  # bits: whole numbers") == []
    assert rules(lint, "y = sum(\n    x for x in z\n)  # bits: whole numbers") == []
    assert rules(lint, "y = x @ z  # bits:") == [(1, "bits"), (1, "mark")]
    assert rules(lint, "y = x + z  # bits: whole numbers") == [(1, "mark")]
    assert rules(lint, 'y = "# bits: in a text"') == []


def test_an_exception_for_a_file_that_excuses_nothing_is_found(
    lint: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    room = tmp_path / "kernels"
    room.mkdir()
    (room / "a.py").write_text("import time\nt = time.time()\n", encoding="utf-8")
    table = {("kernels/a.py", "time"): "told", ("kernels/a.py", "bits"): "gone"}
    monkeypatch.setattr(lint, "EXCEPTIONS", table)
    left = [(one.file, one.line, one.rule, one.what) for one in lint.lint_all(tmp_path)]
    assert left == [("kernels/a.py", 0, "mark", "exception of 'bits'")]


def test_the_command_tells_place_and_exits_1(tmp_path: Path) -> None:
    room = tmp_path / "motion"
    room.mkdir()
    (room / "law.py").write_text("import math\n\nfar = math.hypot(3, 4)\n", encoding="utf-8")
    command = [sys.executable, str(TOOLS / "lint_determinism.py")]
    done = subprocess.run([*command, "--source", str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "motion/law.py:3: bits: math.hypot; rounded as the system likes; instead: " in done.stdout


@pytest.mark.nightly  # with every commit `make style` runs it
def test_the_command_exits_0_where_nothing_is_found() -> None:
    command = [sys.executable, str(TOOLS / "lint_determinism.py")]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0
