"""Fuzzing led by coverage: one parser of ``lampyris selfcheck fuzz``, its good files, Atheris's mutations.

    pip install atheris==3.0.0
    python tools/fuzz_atheris.py png --seconds 7200 --corpus build/fuzz

What a file may do is judged as in the check itself. It stops at the first file that does more, writes it
into the corpus's folder as ``TARGET--crash`` and says what was wrong; copied to ``tests/data/fuzz`` it is
asked for ever. The folder keeps what reached something new: the next run goes on from there. Atheris is no
dependency of ours; it needs Linux or macOS and CPython 3.11 to 3.13.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["lampyris.io.maps", "lampyris.study", "lampyris.movingai", "yaml"]):
    from lampyris_selfcheck.check import Ask
    from lampyris_selfcheck.checks.files import fuzz
    from lampyris_selfcheck.checks.files.fuzz_targets import TARGETS
    from lampyris_selfcheck.scratch import folder

CPU_S = 4.0
"""Code that is watched line by line takes some times as long; the check itself asks for one second."""
MUTANTS = 200
"""Of the check's own, to begin with."""


def main() -> None:
    """Fuzz one target for so long."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--seconds", type=int, default=7200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--corpus", type=Path, default=Path("build/fuzz"))
    asked = parser.parse_args()
    corpus = asked.corpus / asked.target
    corpus.mkdir(parents=True, exist_ok=True)
    for number, data in enumerate(TARGETS[asked.target].mutants.seeds):
        (corpus / f"good-{number}").write_bytes(data)
    for number in range(MUTANTS):
        (corpus / f"mutant-{number}").write_bytes(fuzz.mutant(Ask(asked.seed), asked.target, number))
    fuzz.CPU_S = CPU_S
    read = 0
    with folder() as place:
        case = fuzz.FuzzedReader(asked.target, place)

        def one(data: bytes) -> None:
            nonlocal read
            read += 1
            try:
                # Options go by the number: the length of a file is as good as any, and known again.
                case.read(data, len(data))
            except (Exception, fuzz.Hangs) as problem:
                kept = asked.corpus / f"{asked.target}--crash"
                kept.write_bytes(data)
                print(
                    f"{asked.target}: cases={read} failures=1: {fuzz._told(problem, place)}; kept as {kept}"
                )
                raise

        limits = (f"-max_total_time={asked.seconds}", f"-seed={asked.seed}", "-max_len=20000")
        atheris.Setup([sys.argv[0], *limits, f"-artifact_prefix={asked.corpus}/", str(corpus)], one)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
