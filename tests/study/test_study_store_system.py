"""Stores under a full disk, in a read-only folder, and killed: a clear line, and what was stored stays."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
from pathlib import Path

import numpy as np
import pytest
from store_samples import HERE, bytes_of, child, filled, names, put, rows, study

from lampyris.errors import LampyrisError
from lampyris.study.store.file import log_size
from lampyris.study.store.store import Store, open_for


def in_name_space(shell: str, *words: object) -> subprocess.CompletedProcess[str]:
    """Run a shell script where it may mount; its words are $1 and so on."""
    try:
        done = subprocess.run(
            ["unshare", "-rm", "sh", "-c", shell, "sh", *map(str, words)], capture_output=True, text=True
        )
    except FileNotFoundError:
        pytest.skip("no unshare here")
    if done.returncode == 77 or "unshare" in done.stderr:
        pytest.skip(f"nothing can be mounted here: {done.stderr.strip()}")
    return done


# ---- killed --------------------

KILLED = """
from pathlib import Path
from store_samples import *
from lampyris.study.store.store import open_for
of = study(250)
given = rows(of)
with open_for(Path(sys.argv[1]), of) as store:
    done = store.keys()
    left = [row for row in given if row.key not in done]
    for k in range(0, len(left), 3):
        store.add(left[k : k + 3])
        print(*(row.key for row in left[k : k + 3]), sep="\\n", flush=True)
"""


def killed_often(path: Path, kills: int, seed: int) -> int:
    """Kill a writer again and again at random moments; how often it was killed in the middle of writing."""
    rng = np.random.Generator(np.random.PCG64(seed))
    given = {row.key: row for row in rows(study(250))}
    acknowledged: set[str] = set()
    text = f"import sys; sys.path.insert(0, {str(HERE)!r})\n{KILLED}"
    midway = 0
    for _ in range(kills):
        with subprocess.Popen(
            [sys.executable, "-c", text, str(path)], stdout=subprocess.PIPE, text=True
        ) as one:
            assert one.stdout is not None
            first = one.stdout.readline()
            timer = threading.Timer(float(rng.random() ** 2 * 0.2), one.kill)
            timer.start()
            told = (first + one.stdout.read()).split()
            timer.join()
        midway += one.returncode == -signal.SIGKILL
        assert not set(told) & acknowledged, "what is there was not asked for again"
        acknowledged |= {key for key in told if len(key) == 64}
        with Store.open(path, writable=False) as store:
            found = store.rows()
        assert acknowledged <= set(found)
        assert all(given[key] == row for key, row in found.items())
        if len(found) == len(given):
            for ending in bytes_of(path):
                path.with_name(path.name + ending).unlink()
            acknowledged.clear()
    return midway


def test_a_writer_killed_at_any_moment_loses_nothing_that_it_acknowledged(tmp_path: Path) -> None:
    assert killed_often(tmp_path / "a", 4, 1) > 0


OVERTAKEN = """
import os, subprocess
from store_samples import *
path, given = sys.argv[1], rows(study())
store = Store.open(path)
other = subprocess.Popen([sys.executable, "-c", sys.argv[2], str(path)], stdin=-1, stdout=-1, text=True)
assert other.stdout.readline() == "open\\n"  # while the log is empty
store.add(given[20:21])
Store.open(path, writable=False).close()
other.communicate("close")
assert other.returncode == 0
assert os.path.exists(f"{path}-wal")
for row in given[21:]:
    assert store.add([row]) == 1
os.kill(os.getpid(), 9)
"""
READER = f"""
import sys; sys.path.insert(0, {str(HERE)!r})
from store_samples import *
with Store.open(sys.argv[1], writable=False) as store:
    scan = store.scan()
    next(scan)
    print("open", flush=True)
    sys.stdin.read()
    scan.close()
"""
SQLITE = """
import sqlite3, sys
db = sqlite3.connect(sys.argv[1])
db.execute("SELECT count(*) FROM runs").fetchone()
print("open", flush=True)
sys.stdin.read()
db.close()
"""


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("other", [READER, SQLITE], ids=["reader", "sqlite"])
def test_a_reader_that_closes_does_not_delete_the_log_of_a_writer(tmp_path: Path, other: str) -> None:
    """Closing any descriptor of a file releases the process's POSIX locks on it; SQLite then finds no writer."""
    path = tmp_path / "a"
    filled(path, study(), given=rows(study())[:20])
    done = child(OVERTAKEN, path, other, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    with Store.open(path, writable=False) as store:
        assert list(store.rows().values()) == rows(study())


def test_readers_leave_nothing_behind_but_what_another_has_open(tmp_path: Path) -> None:
    path = tmp_path / "a"
    filled(path, study())
    with Store.open(path, writable=False) as one, Store.open(path, writable=False) as two:
        first, second = one.scan(), two.scan()
        next(first), next(second)
        first.close()
        assert len([*second]) == 39
        assert names(tmp_path) == ["a"]
    with Store.open(path):
        assert len([*Store.open(path, writable=False).scan()]) == 40
        assert names(tmp_path) == ["a", "a-shm", "a-wal", "a.lock"]
    assert names(tmp_path) == ["a"]


def test_a_log_that_goes_while_a_reader_looks_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a"
    filled(path, study())
    monkeypatch.setattr(Path, "exists", lambda self, **more: True)
    assert log_size(path) is None
    with Store.open(path, writable=False) as store:
        assert len(store) == 40


# ---- what the system refuses --------------------

FULL = """
import os, resource, signal
from pathlib import Path
from store_samples import *
from lampyris.errors import LampyrisError
path, of = Path(sys.argv[1]), study()
given = rows(of, words=3000)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
store = Store.create(path, of)
kept = 0
if sys.argv[2] == "rlimit":
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY))
try:
    for k in range(0, len(given), 3):
        store.add(given[k : k + 3])
        kept = min(k + 3, len(given))
    raise SystemExit("nothing was refused")
except LampyrisError as error:
    print(error)
    again = str(error)
for _ in range(2):
    try:
        store.add(given[kept : kept + 3])
        raise SystemExit("nothing was refused")
    except LampyrisError as error:
        assert error.code == "STORE_WRITE", error
assert list(store.rows().values()) == given[:kept]
if sys.argv[3] == "close":
    store.close()
    with Store.open(path, writable=False) as store:
        assert list(store.rows().values()) == given[:kept]
print(kept)
"""


def after_full(path: Path, told: str) -> None:
    """The line is clear, what was acknowledged is there, and the rest can be added when there is room."""
    line, count = told.splitlines()
    kept = int(count)
    assert kept > 0
    assert line.startswith(f"error[STORE_WRITE]: {path}: ")
    assert f"{kept} runs are safe" in line
    given = rows(study(), words=3000)
    with open_for(path, study()) as store:
        assert list(store.rows().values()) == given[:kept]
        store.add(given)
        assert list(store.rows().values()) == given


@pytest.mark.commit(1)
@pytest.mark.parametrize("ending", ["close", "leave"])
def test_files_that_may_not_grow(tmp_path: Path, ending: str) -> None:
    told = child(FULL, tmp_path / "a", "rlimit", ending).stdout
    after_full(tmp_path / "a", told)
    assert names(tmp_path) == ["a"]


@pytest.mark.parametrize("ending", ["close", "leave"])
def test_a_disk_that_is_full(tmp_path: Path, ending: str) -> None:
    """A file system of 160 kB in a name space of its own; copied out of it to be looked at."""
    inner = tmp_path / "small"
    inner.mkdir()
    script = tmp_path / "full.py"
    script.write_text(f"import sys; sys.path.insert(0, {str(HERE)!r})\n{FULL}")
    shell = (
        'mount -t tmpfs -o size=160k tmpfs "$1" || exit 77\n'
        '"$2" "$3" "$1/a" disk "$4" || exit 1\n'
        'cp "$1"/a* "$5"'
    )
    done = in_name_space(shell, inner, sys.executable, script, ending, tmp_path)
    assert done.returncode == 0, done.stderr + done.stdout
    assert "no space left" in done.stdout
    (tmp_path / "a-shm").unlink(missing_ok=True)
    after_full(tmp_path / "a", done.stdout.replace(str(inner / "a"), str(tmp_path / "a")))


READ_ONLY = """
import os
import re
from pathlib import Path
from store_samples import *
from lampyris.errors import LampyrisError
path = Path(sys.argv[1])
with Store.open(path, writable=False) as store:
    assert len(store.rows()) == 40 and len(store.study()) == 40
try:
    Store.open(path)
except LampyrisError as error:
    assert error.code == "STORE_WRITE", error
    print(error)
try:
    Store.create(path.with_name("b"), study())
except LampyrisError as error:
    assert error.code == "STORE_WRITE", error
    print(error)
"""


@pytest.mark.skipif(os.name != "posix", reason="users and permissions")
@pytest.mark.parametrize("how", ["folder", "file", "mount"])
def test_a_folder_or_file_that_may_only_be_read(tmp_path: Path, how: str) -> None:
    folder = tmp_path / "f"
    folder.mkdir()
    filled(folder / "a", study())
    script = tmp_path / "ro.py"
    script.write_text(f"import sys; sys.path.insert(0, {str(HERE)!r})\n{READ_ONLY}")
    before = bytes_of(folder / "a")
    if how == "mount":
        shell = 'mount --bind "$1" "$1" && mount -o remount,ro,bind "$1" || exit 77\n"$2" "$3" "$1/a"'
        done = in_name_space(shell, folder, sys.executable, script)
        assert done.returncode == 0, done.stderr
        assert done.stdout.count("STORE_WRITE") == 2
    elif os.geteuid() == 0:
        pytest.skip("root may write anywhere: see the mount")
    else:
        target = folder if how == "folder" else folder / "a"
        target.chmod(0o555 if how == "folder" else 0o444)
        try:
            assert child(READ_ONLY, folder / "a").stdout.count("STORE_WRITE") == (2 if how == "folder" else 1)
        finally:
            target.chmod(0o755)
    assert bytes_of(folder / "a") == before
    assert set(names(folder)) <= {"a", "b"}


def test_a_connection_that_may_only_read_is_a_clear_line(tmp_path: Path) -> None:
    of = study()
    with Store.create(tmp_path / "a", of) as store:
        store.add(rows(of)[:4])
        assert store._writer is not None
        store._writer.execute("PRAGMA query_only=ON")
        with pytest.raises(LampyrisError, match=r"STORE_WRITE.*read-only.*4 runs are safe"):
            store.add(rows(of))
        store._writer.execute("PRAGMA query_only=OFF")
        store.add(rows(of))
        assert list(store.rows().values()) == rows(of)


@pytest.mark.nightly
def test_runs_in_a_log_that_cannot_be_read_are_not_left_out_in_silence(tmp_path: Path) -> None:
    """SQLite needs to write beside the store to read its log; without it the runs there would be missing."""
    folder = tmp_path / "f"
    folder.mkdir()
    with Store.create(folder / "a", study()) as store:
        store.add(rows(study()))
        files = bytes_of(folder / "a")
    put(folder / "a", {ending: files[ending] for ending in ("", "-wal")})
    code = """
    from store_samples import *
    from lampyris.errors import LampyrisError
    for path in sys.argv[1:]:
        try:
            with Store.open(path, writable=False) as store:
                print(len(store))
        except LampyrisError as error:
            print(error)
    """
    (tmp_path / "code.py").write_text(
        f"import sys; sys.path.insert(0, {str(HERE)!r})\n{textwrap.dedent(code)}"
    )
    shell = 'mount --bind "$1" "$1" && mount -o remount,ro,bind "$1" || exit 77\n"$2" "$3" "$1/a"'
    done = in_name_space(shell, folder, sys.executable, tmp_path / "code.py")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(
        r"error\[STORE_READ\]: .*runs are in its log.*copy it and a-wal to a folder.*\n", done.stdout
    )
    assert child(code, folder / "a").stdout == "40\n"


def test_a_damaged_store_in_a_read_only_folder_is_repaired_elsewhere(tmp_path: Path) -> None:
    folder, given = tmp_path / "f", rows(study())
    folder.mkdir()
    filled(folder / "a", study())
    hurt = bytearray((folder / "a").read_bytes())
    hurt[hurt.rindex(given[2].key.encode()) + 66] ^= 4
    put(folder / "a", {"": bytes(hurt)})
    code = """
    from pathlib import Path
    from lampyris.errors import LampyrisError
    from lampyris.study.store.repair import repair
    print(repair(sys.argv[1], sys.argv[2]).kept)
    try:
        repair(sys.argv[1])
    except LampyrisError as error:
        print(error.code)
    """
    (tmp_path / "code.py").write_text(f"import sys\n{textwrap.dedent(code)}")
    shell = 'mount --bind "$1" "$1" && mount -o remount,ro,bind "$1" || exit 77\n"$2" "$3" "$1/a" "$4"'
    done = in_name_space(shell, folder, sys.executable, tmp_path / "code.py", tmp_path / "b")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "39\nSTORE_WRITE\n"
    assert bytes_of(folder / "a") == {"": bytes(hurt)}
    with Store.open(tmp_path / "b", writable=False) as store:
        assert list(store.rows().values()) == [*given[:2], *given[3:]]


@pytest.mark.skipif(not hasattr(os, "setuid") or os.geteuid() != 0, reason="only root becomes another user")
def test_a_reader_who_may_not_write_to_the_file_leaves_nothing_that_keeps_its_owner_out() -> None:
    code = """
    import os
    import encodings.ascii, sqlite3, filelock  # before the folders of this user are closed to us
    from store_samples import *
    os.setuid(65534)
    with Store.open(sys.argv[1], writable=False) as store:
        print(len(store.rows()), names(os.path.dirname(sys.argv[1])))
    """
    with tempfile.TemporaryDirectory() as folder:  # pytest's own are closed to other users
        path = Path(folder, "a")
        filled(path, study())
        path.chmod(0o444)
        Path(folder).chmod(0o777)
        assert child(code, path).stdout == "40 ['a']\n"
