"""The file of a replay: one HTML document with the run, the map and the modules that play them.

It loads nothing: its content security policy names the hashes of its own scripts and styles and allows no request at all, so
that it can be opened from a disk, sent by mail, or shown in an ``<iframe>``.
"""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from lampyris.app.replay import bundle
from lampyris.report.html.render import printable, render

ENTRIES: Final[Mapping[str, str]] = {"run": "viewer.js", "fleet": "fleetviewer.js"}
"""What is replayed, and the module that plays it."""
SHEETS: Final[Mapping[str, tuple[str, ...]]] = {
    "run": ("theme.css", "uplot.css", "see.css"),
    "fleet": ("theme.css", "uplot.css", "see.css", "forms.css"),
}


@dataclass(frozen=True, eq=False)
class RunPage:
    """What a file of a replay holds.

    Parameters
    ----------
    kind : run (of one robot, in ticks or in continuous time) or fleet.
    name : what the page is called.
    digest : SHA-256 of the result's JSON, as :func:`lampyris.app.engine.simulation.digest` has it.
    facts : names and values that are listed beside the map.
    ground : the map, as frames. stream : the run, as frames.
    layer : a frame of a layer beneath the path, or nothing.
    more : what the module needs besides, as plain data.
    """

    kind: str
    name: str
    digest: str
    facts: Sequence[tuple[str, str]]
    ground: bytes
    stream: bytes
    layer: bytes = b""
    more: Mapping[str, Any] = field(default_factory=dict)


def replay_page(replay: RunPage) -> str:
    """The file, as HTML; the same bytes for the same run.

    Examples
    --------
    >>> page = replay_page(RunPage("run", "A </script> name", "0" * 64, (), b"", b""))
    >>> "A </script> name" in page, "fetch" in page.split("Content-Security-Policy")[1].split(">")[0]
    (False, False)
    """
    facts = [[str(printable(name)), str(printable(value))] for name, value in replay.facts]
    data = {
        **replay.more,
        "name": str(printable(replay.name)),
        "digest": replay.digest,
        "facts": facts,
        "ground": packed(replay.ground),
        "layer": packed(replay.layer) if replay.layer else "",
        "stream": packed(replay.stream),
    }
    scripts = [bundle.charts(), bundle.script(ENTRIES[replay.kind])]
    style = bundle.style(*SHEETS[replay.kind])
    return render(
        "app/replay/page.html.j2",
        title=replay.name,
        scripts=scripts,
        hashes=[integrity(text) for text in scripts],
        style=style,
        style_hash=integrity(style),
        data=json_text(data),
    )


def packed(data: bytes) -> str:
    """Bytes, deflated (raw), in base64."""
    squeeze = zlib.compressobj(9, zlib.DEFLATED, -15)
    return base64.b64encode(squeeze.compress(data) + squeeze.flush()).decode("ascii")


def integrity(text: str) -> str:
    """The hash of an element's text, as a content security policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def json_text(data: Any) -> str:
    """JSON that can stand in an element: no sign in it begins or ends one."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=True)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
