"""The pages use the field's words: none of those that only this project used."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
GENERATED = {"benchmarks.md", "promises.md", "licences.md"}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
OLD = re.compile(
    r"\b(bod(y|ies)|movers?|told|mend(s|ed|ing)?|dear(er|est)?|crowds?|held by|strangers?|unheard"
    r"|anew|whoever|somebody|anybody|everybody|taut|strollers?|rivals?|changes? of mind)\b",
    re.IGNORECASE,
)
pytestmark = pytest.mark.source


def prose(text: str) -> str:
    """A page without code: blocks, indented lines, words in backticks, targets of links, generated tables."""
    text = re.sub(r"<!-- tables -->.*?<!-- end of tables -->", "", text, flags=re.DOTALL)
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^ {4}.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"`[^`]*`", "", text)
    return re.sub(r"\]\([^)]*\)", "]", text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_has_no_word_of_the_old_language(page: Path) -> None:
    if page.name in GENERATED:
        pytest.skip("made by a tool, from words of its own")
    text = prose(page.read_text(encoding="utf-8"))
    allowed = {"request bodies", "its body", "header, address, body", "rigid\nbody"}
    found = [text[max(0, m.start() - 24) : m.end() + 10] for m in OLD.finditer(text)]
    assert [one for one in found if not any(word in one for word in allowed)] == []
