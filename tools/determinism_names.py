"""Names that code which decides must not read: for tools/determinism_rules.py."""

from __future__ import annotations

OURS = "lampyris._core.elementary has exp, log, sin, cos and atan2"
SUMS = "products and a sum, in a stated order"
_SAID = {
    "exp exp2 expm1 log log2 log10 log1p logaddexp logaddexp2 geomspace logspace": OURS,
    "sin cos tan asin acos atan atan2 arcsin arccos arctan arctan2 angle sinc i0": OURS,
    "sinh cosh tanh asinh acosh atanh arcsinh arccosh arctanh gamma lgamma erf erfc cbrt": OURS,
    "power pow float_power": "a product, or lampyris._core.elementary.exp and log",
    "hypot dist": "lampyris._core.elementary.hypot, or sqrt(x * x + y * y)",
    "dot vdot inner matmul tensordot einsum vecdot matvec vecmat sumprod": SUMS,
    "convolve correlate cov corrcoef polyfit": SUMS,
    "interp": "lampyris._core.elementary.interp",
    "fma": "a * b + c, rounded twice",
}
INSTEAD = {word: instead for words, instead in _SAID.items() for word in words.split()}
"""Functions of ``math`` and ``numpy`` whose last bit is not defined, and what to write."""

_DRAWN = """
normal standard_normal exponential standard_exponential gamma standard_gamma beta poisson binomial lognormal
laplace logistic gumbel weibull pareto rayleigh wald vonmises standard_t standard_cauchy multivariate_normal
triangular uniform chisquare geometric hypergeometric logseries zipf
"""
LAWS = frozenset(_DRAWN.split())
"""Draws of a Generator that go through libm or round twice in one C expression."""

STREAMS = frozenset({"Generator", "PCG64", "SeedSequence", "BitGenerator"})
LISTINGS = frozenset({"os.listdir", "os.scandir", "os.walk", "glob.glob", "glob.iglob"})
LISTING_METHODS = frozenset({"iterdir", "glob", "rglob"})
CHANCE = frozenset({"os.urandom", "uuid.uuid1", "uuid.uuid4"})
MODULES = frozenset({"numpy", "math", "time", "datetime", "os", "uuid", "glob", "operator"})
MODULES |= {f"numpy.{part}" for part in ("random", "linalg", "fft")}
"""Under another name, or handed on, what is read of them could not be told."""

CLOCKS = frozenset(f"lampyris.kernels.loading.{clock}" for clock in ("wall", "cpu", "seconds"))
"""Our own clocks."""

POWERS = frozenset({"operator.pow", "operator.ipow"})
PRODUCTS = frozenset({"operator.matmul", "operator.imatmul"})
_POWER = ("pow rounds as the system likes", "x * x, or whole numbers")
_SEEDED = "Generator(PCG64(SeedSequence(...)))"

Told = tuple[str, str, str, str]
"""Rule, what, why, instead."""


def banned(name: str) -> Told | None:
    """What is said of a function that must be neither called nor handed on; None: it may be.

    Parameters
    ----------
    name : dotted, with its import resolved.
    """
    root, _, last = name.rpartition(".")
    if root in {"math", "numpy"} and last in INSTEAD:
        return "bits", name, "rounded as the system likes", INSTEAD[last]
    if root.startswith(("numpy.linalg", "numpy.fft")) and not last[:1].isupper():
        return "bits", name, "the order of its sums is the machine's", SUMS
    if name in POWERS:
        return "bits", name, *_POWER
    if name in PRODUCTS:
        return "bits", name, "the order of BLAS's sums is the machine's", SUMS
    if name.startswith("numpy.random.") and name.split(".")[2] not in STREAMS:
        return "random", name, "not seeded by us", _SEEDED
    if name in CHANCE:
        return "random", name, "another each time", _SEEDED
    if name.startswith(("time.", "datetime.")) or name in CLOCKS:
        return "time", name, "another each time", "count steps; or say that nothing is decided by it"
    return None


def banned_builtin(name: str) -> Told | None:
    """The same of functions that come with the language."""
    if name == "pow":
        return "bits", name, *_POWER
    if name == "sum":
        return "sum", name, "from Python 3.12 on it carries what rounding loses", "math.fsum, or a loop"
    if name in {"hash", "id"}:
        return "order", f"{name}()", "another in each process", "a key of its own, or zlib.crc32"
    return None
