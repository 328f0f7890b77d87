"""Every page and section that the code or a page of the docs cites exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "benchmarks" / "README.md"])
CODE = sorted(
    path
    for folder in ("src", "tests", "tools", "benchmarks", "examples")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".py", ".json", ".yaml", ".toml", ".js", ".html", ".sh"} and path != Path(__file__)
)
# Pages of other projects, and pages that a test or a tool writes.
ELSEWHERE = {"Problem_Definition.md", "attributes_table.md", "page.md"}
# Pages of the site that are derived from the program (site/derived_pages.py).
ELSEWHERE |= {"errors.md", "laws.md", "plan.md", "planners.md", "settings.md"}
PAGE = re.compile(r"[\w./-]*\w\.md\b")
# After the name of a page: a quoted title, or a number, which another order of sections makes wrong.
TITLE = re.compile(r',? \\?"([^"\\]+)\\?"')
NUMBER = re.compile(r",? (?:section |chapter |§ ?)?\d")
LINK = re.compile(r"(?<!\w)\[[^\]]*\]\(([^)\s]+)\)")


def titles(page: Path) -> set[str]:
    """The headings of a page as one cites them: without number and without the files in brackets."""
    lines = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL).splitlines()
    heads = (line.lstrip("#").strip() for line in lines if re.match(r"#{1,6} ", line))
    return {re.sub(r"^\d+\. | \([^)]*\)$", "", head) for head in heads}


def anchor(title: str) -> str:
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def anchors(page: Path) -> set[str]:
    lines = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL).splitlines()
    return {anchor(line.lstrip("#").strip()) for line in lines if re.match(r"#{1,6} ", line)}


def faults(text: str) -> list[str]:
    """What is wrong with the citations of pages in a text."""
    plain = re.sub(r"\s+(?:# )?", " ", text)
    found = []
    for cited in PAGE.finditer(plain):
        name = cited.group().rpartition("/")[2]
        pages = [page for page in PAGES if page.name == name]
        if not pages:
            found += [] if name in ELSEWHERE else [f"{cited.group()}: no such page"]
            continue
        if "/" in cited.group():
            pages = [page for page in pages if page.as_posix().endswith("/" + cited.group().lstrip("./"))]
        after = plain[cited.end() :]
        if NUMBER.match(after):
            found.append(f"{cited.group()}{after[:20]}: cite a section by its title")
        title = TITLE.match(after)
        if title and not any(title.group(1) in titles(page) for page in pages):
            found.append(f"{cited.group()}: no section {title.group(1)!r}")
    return found


@pytest.mark.nightly
@pytest.mark.source
def test_every_page_and_section_that_the_code_cites_exists() -> None:
    texts = {path: path.read_text(encoding="utf-8") for path in CODE}
    assert sum(".md" in text for text in texts.values()) > 40
    assert sum(len(TITLE.findall(text)) for text in texts.values() if "method.md" in text) > 10
    wrong = {str(path.relative_to(ROOT)): found for path, text in texts.items() if (found := faults(text))}
    assert not wrong


@pytest.mark.source
def test_links_between_the_pages_lead_somewhere() -> None:
    wrong, looked_at = [], 0
    for page in PAGES:
        for target in LINK.findall(page.read_text(encoding="utf-8")):
            if target.startswith(("http://", "https://", "mailto:")):
                continue
            looked_at += 1
            name, _, part = target.partition("#")
            other = (page.parent / name).resolve() if name else page
            if not other.exists() or (part and other.suffix == ".md" and part not in anchors(other)):
                wrong.append(f"{page.relative_to(ROOT)}: {target}")
    assert looked_at > 80
    assert not wrong


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('the law of method.md, "The dissertation\'s speed law"', None),
        ("the law of method.md section 6", "title"),
        ("the law of method.md,\n    section 6", "title"),
        ("the law (algorithms.md 7)", "no such page"),
        ('the law of method.md, "Speed"', "no section 'Speed'"),
        ("the law of docs/speed/cloud.md.", None),
    ],
)
@pytest.mark.source
def test_a_wrong_citation_is_seen(text: str, fault: str | None) -> None:
    found = faults(text)
    assert (not found) if fault is None else (len(found) == 1 and fault in found[0])
