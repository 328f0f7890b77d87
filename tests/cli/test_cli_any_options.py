"""Whatever the options of whatever verb: exit code 0, 2, 3, 4 or 5, never 1 or 6, and no traceback."""

from __future__ import annotations

import sys
from collections import Counter

import option_draws
import pytest
from option_draws import MAY, drawn, verbs

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="pipes, sockets and limits of processes")
SEED = 2
COMMIT, NIGHTLY = 20, 20_000


@pytest.mark.nightly
def test_every_verb_and_every_option_is_drawn() -> None:
    seen: dict[str, set[str]] = {name: set() for name in verbs()}
    for number in range(6000):
        words = drawn(SEED, number)
        for name in (" ".join(words[:2]), words[0] if words else ""):
            if name in seen:
                seen[name] |= {word.partition("=")[0] for word in words if word.startswith("-")}
                break
    for name, command in verbs().items():
        for parameter in command.params:
            if parameter.param_type_name == "option" and name not in option_draws.SLOW:
                assert seen[name] & {*parameter.opts, *parameter.secondary_opts}, (name, parameter.opts)


def test_a_case_is_known_by_its_seed_and_number() -> None:
    assert [drawn(SEED, k) for k in range(200)] == [drawn(SEED, k) for k in range(200)]
    assert len({drawn(SEED, k) for k in range(400)}) > 300


@pytest.mark.parametrize("code", [1, 6, 99, -11])
def test_a_wrong_exit_code_is_seen(code: int) -> None:
    assert code not in MAY
    assert option_draws.Ended(0, ("plan",), code, "", "", 0.1).wrong
    assert option_draws.Ended(0, ("plan",), 3, "", "Traceback (most recent call last)", 0.1).wrong
    assert option_draws.Ended(0, ("plan",), 2, "", "", 0.1).wrong
    assert not option_draws.Ended(0, ("plan",), 2, "", "error[TYPE]: x", 0.1).wrong


def judge(cases: int) -> None:
    counts: Counter[int] = Counter()
    wrong = []
    for ended in option_draws.run(SEED, range(cases)):
        counts[ended.code] += 1
        if ended.wrong:
            wrong.append(f"{ended.number} {ended.words!r}: {ended.wrong}")
    assert not wrong, "\n".join(wrong)
    assert sum(counts.values()) == cases
    for code, share in ((0, 0.15), (2, 0.2), (3, 0.05)):
        assert counts[code] > share * cases, f"cases are not alike: {counts}"


def test_any_options_of_any_verb() -> None:
    judge(COMMIT)


@pytest.mark.nightly
def test_any_options_of_any_verb_20_000() -> None:
    judge(NIGHTLY)
