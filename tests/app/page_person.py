"""What a person does with the page: aims at cells, reads words. Nothing of the page's own code is called."""

from __future__ import annotations

import base64
import json
import time
import zlib
from collections.abc import Callable, Sequence
from io import BytesIO
from typing import Any
from urllib.parse import parse_qs

from page_browser import SOON
from PIL import Image, ImageChops

Cell = tuple[int, int]


def aim(page: Any, cell: Cell, size: Cell = (50, 50)) -> tuple[float, float]:
    """Where a cell of a map that is wholly shown is on the screen."""
    box = page.locator("#map").bounding_box()
    scale = min((box["width"] - 140) / size[0], (box["height"] - 32) / size[1], 96)
    left = box["x"] + (box["width"] - size[0] * scale) / 2
    top = box["y"] + (box["height"] - size[1] * scale) / 2
    return left + (cell[0] + 0.5) * scale, top + (cell[1] + 0.5) * scale


def click(page: Any, cell: Cell, size: Cell = (50, 50)) -> None:
    """Click a cell."""
    page.mouse.click(*aim(page, cell, size))


def draw(page: Any, cells: Sequence[Cell], size: Cell = (50, 50)) -> None:
    """Draw with the pressed button from cell to cell."""
    page.mouse.move(*aim(page, cells[0], size))
    page.mouse.down()
    for cell in cells[1:]:
        page.mouse.move(*aim(page, cell, size), steps=4)
    page.mouse.up()


def fact(page: Any, name: str) -> str:
    """A number of the status, by its name."""
    found: str = page.locator(f'#status dt:text-is("{name}") + dd').inner_text()
    return found


def moment(page: Any) -> int:
    """The tick that is shown."""
    return int(page.get_by_role("slider", name="Moment").get_attribute("aria-valuenow"))


def until(page: Any, true: Callable[[], bool]) -> None:
    """Wait for something, as long as for a step of the browser at most."""
    end = time.monotonic() + SOON / 1000
    while not true():
        assert time.monotonic() < end, "it did not come to that"
        page.wait_for_timeout(25)


def later(page: Any, milliseconds: int) -> None:
    """Wait by a timer of the page: its own timers that were due before are over, however slow it is."""
    page.evaluate("time => new Promise((over) => setTimeout(over, time))", milliseconds)


def loaded(page: Any) -> None:
    """Wait until half a second has brought no further file or answer.

    Playwright's ``networkidle`` counts the page's icon, of which it does not always hear that it has come.
    """
    came, before = "performance.getEntriesByType('resource').length", -1
    while (now := page.evaluate(came)) != before:
        before = now
        later(page, 500)


PACK = """async () => {
  const stream = new Blob([location.href]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  await new Response(stream).arrayBuffer();
}"""


def addressed(page: Any) -> None:
    """Wait until the address holds what was done last: its time has come, and it is packed."""
    later(page, 450)
    for _ in range(2):
        page.evaluate(PACK)


def drawn(page: Any) -> None:
    """Wait until what was done last has been drawn."""
    frames = "requestAnimationFrame(() => requestAnimationFrame(over))"
    page.evaluate(f"() => new Promise((over) => {frames})")


def in_address(page: Any) -> dict[str, Any]:
    """The scenario that the address holds, once it holds what was done last."""
    addressed(page)
    said = parse_qs(page.url.partition("#")[2])
    packed = said["s"][0]
    text = zlib.decompress(base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), -15)
    found: dict[str, Any] = json.loads(text)
    for edit in found["edits"]:
        edit.update({key: unpacked(edit[key]) for key in ("blocked", "freed")})
    return found


def unpacked(cells: Any) -> list[list[int]]:
    """Cells of a list, or of runs within rows, as the app's page says of links."""
    if isinstance(cells, list):
        return cells
    rows = cells["rows"]
    found: list[list[int]] = []
    y = end = 0
    for down, on, n in zip(rows[::3], rows[1::3], rows[2::3], strict=True):
        y, first = y + down, (0 if down else end) + on
        end = first + n
        found += [[x, y] for x in range(first, end)]
    return found


def picture(page: Any) -> Image.Image:
    """The map as it is seen."""
    return Image.open(BytesIO(page.locator("#map").screenshot())).convert("RGB")


def changed(before: Image.Image, after: Image.Image) -> float:
    """The share of pixels that are not the same."""
    other = ImageChops.difference(before, after).convert("L").point(lambda v: 255 if v > 24 else 0)
    return other.histogram()[255] / (before.width * before.height)
