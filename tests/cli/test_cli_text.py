"""What goes into a pipe or a file: a line a fact, a line a row, not wrapped, not padded; and ``--csv -``."""

from __future__ import annotations

import csv
import io
import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from bad_inputs.case import Outcome, inside, run, warm

SCEN = "version 1\n0\tq.map\t4\t3\t0\t0\t3\t0\t3.00000000\n0\tq.map\t4\t3\t0\t0\t3\t2\t4.5\n"
TEXT: dict[str, tuple[str, ...]] = {
    "plan": ("plan", "env-1"),
    "plan explained": ("plan", "guide", "--explain"),
    "simulate": ("simulate", "guide", "--obstacles", "2"),
    "drive": ("drive", "guide", "--obstacles", "1"),
    "speed": ("speed", "guide", "--explain"),
    "compare": ("compare", "env-1"),
    "maps": ("maps",),
    "a map": ("maps", "env-1"),
    "a map file": ("maps", "q.map"),
    "recipes": ("maps", "recipes"),
    "planners": ("planners",),
    "laws": ("laws",),
    "a law": ("laws", "physical"),
    "movingai": ("movingai", "q.scen"),
    "studies": ("study", "list"),
    "run": ("run", "s.yaml"),
}


@pytest.fixture
def here(tmp_path: Path) -> Callable[..., Outcome]:
    warm()
    (tmp_path / "q.map").write_text("type octile\nheight 3\nwidth 4\nmap\n....\n....\n....\n")
    (tmp_path / "q.scen").write_text(SCEN)
    (tmp_path / "s.yaml").write_text("version: 1\nmap: {bundled: guide}\n")

    def call(*words: str) -> Outcome:
        with inside(tmp_path):
            return run(*words)

    return call


@pytest.mark.parametrize("name", TEXT)
def test_piped_text_is_plain_unwrapped_and_unpadded(
    here: Callable[..., Outcome], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    done = here(*TEXT[name])
    assert done.exit == 0, done.err
    lines = done.out.splitlines()
    assert all(line == line.rstrip(" ") for line in lines), "no padding at the end of a line"
    assert all("  " not in line.strip() for line in lines), "no columns made of spaces"
    assert not any(c in done.out for c in "━│┃┏╭─\x1b")
    monkeypatch.setenv("COLUMNS", "400")
    assert len(here(*TEXT[name]).out.splitlines()) == len(lines), "no line is wrapped"


def test_grep_finds_the_number_beside_the_name(here: Callable[..., Outcome]) -> None:
    (line,) = (line for line in here("plan", "env-1").out.splitlines() if "gap" in line)
    assert line.endswith("best 57.799, gap 9.54%")


def test_help_is_not_wrapped_in_a_pipe(here: Callable[..., Outcome]) -> None:
    (line,) = (line for line in here("plan", "--help").out.splitlines() if "--csv" in line)
    assert "x_m, y_m, yaw, v, t_s, s, a, cause, x, y, why." in line


def test_a_comb_of_gates_is_summed_up(tmp_path: Path, here: Callable[..., Outcome]) -> None:
    """Two rooms joined by many openings one cell wide: a few are printed, JSON has all."""
    width = 121
    teeth = "".join("#."[k % 2] for k in range(width))
    rows = ["." * width, teeth, "." * width]
    (tmp_path / "comb.txt").write_text("\n".join(rows * 10) + "\n")
    words = ("plan", "comb.txt", "--start", "1,0", "--goal", "1,29", "--set", "choice=exact")
    done = here(*words)
    assert done.exit == 0, done.err
    (line,) = (line for line in done.out.splitlines() if line.startswith("gates: "))
    assert line.startswith("gates: on the path: (1, 1), ")
    assert line.endswith(" and 2 more (--json has all); in the map: 600")
    sealed = here(*words[:-1], "gates=replan")
    assert sealed.exit == 4
    assert " more." in sealed.out
    assert max(map(len, sealed.out.splitlines())) < 300


@pytest.mark.parametrize(
    ("words", "columns"),
    [
        (
            ("plan", "guide"),
            "x_m,y_m,yaw,v,t_s,s,a,cause,x,y,why,ring1,ring2,obstacle_velocity,angle_deg,angle_velocity",
        ),
        (
            ("plan", "guide", "--preset", "dissertation"),
            "x_m,y_m,yaw,v,t_transfers,s,a,cause,x,y,why,ring1,ring2,obstacle_velocity,angle_deg,angle_velocity",
        ),
        (("simulate", "guide", "--obstacles", "1"), "x_m,y_m,yaw,v,tick,cause,x,y,event"),
        (("drive", "guide", "--obstacles", "0"), "t_s,x_m,y_m,yaw,v,a,s,leg,cause,why"),
        (("speed", "guide"), "x_m,y_m,yaw,v,t_s,s,a,cause,why"),
        (("compare", "guide", "--planners", "astar"), None),
        (("movingai", "q.scen"), None),
        (
            ("run", "s.yaml"),
            "x_m,y_m,yaw,v,t_s,s,a,cause,x,y,why,ring1,ring2,obstacle_velocity,angle_deg,angle_velocity",
        ),
    ],
)
def test_csv_to_standard_output(
    here: Callable[..., Outcome], words: tuple[str, ...], columns: str | None
) -> None:
    done = here(*words, "--csv", "-")
    assert done.exit == 0, done.err
    rows = list(csv.reader(io.StringIO(done.out)))
    assert len(rows) > 1
    assert len({len(row) for row in rows}) == 1, "nothing but the table"
    assert columns is None or ",".join(rows[0]) == columns
    assert done.err, "the text for people is on standard error"
    assert not Path("-").exists()
    both = here(*words, "--csv", "-", "--json")
    assert (both.exit, both.out) == (2, "")
    assert "--csv - and --json both write to standard output" in both.err


def test_a_device_that_keeps_nothing_may_be_written_to(here: Callable[..., Outcome]) -> None:
    assert here("plan", "guide", "--csv", "/dev/null").exit == 0


@pytest.mark.parametrize(
    ("words", "allowed"),
    [
        (("plan", "guide", "--csv", "p.bag"), ".csv"),
        (("plan", "guide", "--picture", "p.csv"), ".svg"),
        (("plan", "guide", "--picture", "-"), ".svg"),
        (("plan", "guide", "--save-scenario", "-"), ".yaml"),
        (("simulate", "guide", "--film", "f.mp4"), ".webp"),
        (("simulate", "guide", "--csv", "p.json"), ".csv"),
        (("drive", "guide", "--chart", "p.jpg"), ".svg"),
        (("speed", "guide", "--csv", "p.xlsx"), ".csv"),
        (("compare", "guide", "--csv", "p.parquet"), ".csv"),
        (("movingai", "q.scen", "--csv", "p.yaml"), ".csv"),
        (("run", "s.yaml", "--picture", "p.gif"), ".svg"),
        (("study", "export", "x.study.db", "--latex", "t.csv"), ".tex"),
        (("study", "export", "x.study.db", "--parquet", "t.csv"), ".parquet"),
        (("selfcheck", "grids", "--cases", "1", "--record", "r.csv"), ".jsonl"),
        (("selfcheck", "grids", "--cases", "1", "--ledger", "r.png"), ".ledger"),
    ],
)
def test_an_ending_that_promises_another_format_is_refused(
    tmp_path: Path, here: Callable[..., Outcome], words: tuple[str, ...], allowed: str
) -> None:
    there = sorted(tmp_path.iterdir())
    done = here(*words)
    assert (done.exit, done.out) == (2, ""), done.err
    assert allowed in done.err
    assert sorted(tmp_path.iterdir()) == there, "nothing is written"


OUTPUTS = [
    ("plan", "guide", "--csv"),
    ("plan", "guide", "--picture"),
    ("plan", "guide", "--save-scenario"),
    ("simulate", "guide", "--film"),
    ("simulate", "guide", "--replay"),
    ("speed", "guide", "--chart"),
    ("maps", "convert", "guide"),
    ("study", "write", "density"),
    ("selfcheck", "grids", "--cases", "1", "--only", "3x3", "--ledger"),
    ("selfcheck", "grids", "--cases", "1", "--only", "3x3", "--record"),
]
NAMES = {
    "--csv": ".csv", "--picture": ".png", "--save-scenario": ".yaml", "--film": ".gif", "--replay": ".html", "--chart": ".svg",
    "guide": ".txt", "density": ".yaml", "--ledger": ".ledger", "--record": ".jsonl",
}  # fmt: skip


@pytest.mark.commit(14)
@pytest.mark.parametrize("words", OUTPUTS, ids=lambda words: f"{words[0]} {words[-1]}")
@pytest.mark.parametrize("kind", ["pipe", "loop", "folder", "socket", "no folder", "too long"])
def test_a_place_that_cannot_be_written_is_refused_at_once(
    tmp_path: Path, here: Callable[..., Outcome], words: tuple[str, ...], kind: str
) -> None:
    name = f"out{NAMES[words[-1]]}"
    place = tmp_path / name
    with socket.socket(socket.AF_UNIX) as bound:
        if kind == "pipe":
            os.mkfifo(place)
        elif kind == "loop":
            place.symlink_to(name)
        elif kind == "folder":
            place.mkdir()
        elif kind == "socket":
            with inside(tmp_path):
                bound.bind(name)
        given = {"no folder": f"nowhere/{name}", "too long": "x" * 300 + name}.get(kind, name)
        force = () if words[0] == "selfcheck" else ("--force",)
        done = here(*words, given, *force)
    assert (done.exit, done.out) == (3, ""), done.err
    assert done.err.startswith("error[FILE_WRITE]: ")
    assert given in done.err


def test_an_old_ledger_that_is_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    from lampyris.errors import FileError
    from lampyris_selfcheck.ledger import Ledger

    os.mkfifo(tmp_path / "l")
    with pytest.raises(FileError, match="no regular file"):
        Ledger(tmp_path / "l")
