"""The site: every page of docs has its place in it, every public name its topic."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.source


def _pages(node: object) -> set[Path]:
    """The pages that a part of the table of contents names."""
    if isinstance(node, list):
        return {page for one in node for page in _pages(one)}
    if not isinstance(node, dict):
        return set()
    found = {page for one in node.values() for page in _pages(one)}
    if "file" in node:
        found.add(ROOT / f"{node['file']}.md")
    if "glob" in node:
        found |= set(ROOT.glob(f"{node['glob']}.md"))
    return found


def test_every_page_is_in_the_table_of_contents() -> None:
    contents = _pages(yaml.safe_load((ROOT / "site/toc.yml").read_text(encoding="utf-8")))
    missing = {str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md")} - {
        str(page.relative_to(ROOT)) for page in contents
    }
    assert not missing


def test_every_public_name_has_a_topic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "site"))
    import derived_pages

    monkeypatch.delitem(sys.modules, "derived_pages")
    derived_pages.write_pages(tmp_path / "reference")
    made = {page.name for page in (tmp_path / "reference").rglob("*.md")}
    assert {"python.md", "planners.md", "laws.md", "settings.md", "errors.md", "plan.md"} <= made
    assert "| `SETTING_CLASH` |" in (tmp_path / "reference/errors.md").read_text(encoding="utf-8")
