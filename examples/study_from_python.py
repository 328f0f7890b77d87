"""A small study from Python: two choices of AD-GSO and D* Lite in the same worlds, kept, continued, told."""

import tempfile
from pathlib import Path

import lampyris
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise

STUDY = """\
version: 1
name: choices
maps:
  - {bundled: env-2, queries: {random: 4, least: 25}}
planners:
  - ad-gso
  - {name: ad-gso, settings: {choice: exact}}
  - dstar-lite
traffic:
  - {kind: random-walk, count: 20}
seeds: 3
"""

with tempfile.TemporaryDirectory() as folder:
    file, store = Path(folder) / "choices.yaml", Path(folder) / "choices.study.db"
    file.write_text(STUDY)
    study = lampyris.load_study(file)
    print(f"{len(study)} runs: {len(study.worlds)} queries, {len(study.planners)} planners")
    table = lampyris.run_study(study, store)
    again = lampyris.run_study(study, store, progress=lambda p: print(f"{p.done} of {p.total} there"))
    assert list(table.lines()) == list(again.lines())

summary = summarise(runs_of(study, table.records()))
for entry in summary.entries:
    cost, arrived = entry.own["cost"], entry.own["arrived"]
    print(
        f"{entry.entrant:22} arrived {arrived.value:.0%} of {entry.runs}, "
        f"cost {cost.value:.2f} [{cost.low:.2f}, {cost.high:.2f}] over {cost.units} queries"
    )
for pair in summary.pairs:
    if pair.measure == "cost":
        d = pair.difference
        print(f"{pair.entrant} less {pair.reference}: {d.value:+.2f} [{d.low:+.2f}, {d.high:+.2f}] cells")
