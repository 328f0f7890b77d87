"""Measure the order of the source tree; exit 1 if it is out of order.

    python tools/house.py [--json]

Rules (docs/architecture.md): a folder holds at most 16 modules; no import circle of any kind (at module level,
within functions, for type checkers alone); at most 5 public class names that are defined in several modules;
words of the first edition's own language only in the files that are listed in tools/old_words.txt, which may
only become fewer.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {
    "lampyris": ROOT / "src" / "lampyris",
    "lampyris_selfcheck": ROOT / "selfcheck/src/lampyris_selfcheck",
}
KEPT = ROOT / "tools" / "old_words.txt"
MOST_MODULES = 16
MOST_DOUBLED = 5
WORDS = (
    "strollers?", "unheard", "whoever", "dearer", "roomy", "twins?", "held by", "told of", "begins? anew",
    "go(?:es|ne)? on with", "mend(?:s|ed|ers?|ing)?", "crowd", "the house", "halting", "look_at", "kept_in",
    "lat_max", "flips", "crowding", "warmth", "keep_away", "roomy_\\w+",
)  # fmt: skip
OLD = re.compile(rf"\b(?:{'|'.join(WORDS)})\b")


def modules() -> dict[str, Path]:
    """Every module by its dotted name."""
    found = {}
    for package, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*.py")):
            parts = (package, *path.relative_to(folder).with_suffix("").parts)
            found[".".join(parts).removesuffix(".__init__")] = path
    return found


def imports(tree: ast.Module, names: Mapping[str, Path]) -> Iterator[str]:
    """Modules of ours that a module imports, wherever it does."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                if full in names or node.module in names:
                    yield full if full in names else node.module


def circles(edges: Mapping[str, set[str]]) -> list[list[str]]:
    """Groups of modules that import each other, directly or by others."""
    reached: dict[str, set[str]] = {}
    for start in edges:
        seen: set[str] = set()
        todo = list(edges[start])
        while todo:
            name = todo.pop()
            if name not in seen:
                seen.add(name)
                todo += edges[name]
        reached[start] = seen
    groups = {frozenset(b for b in reached[a] if a in reached[b]) for a in edges if a in reached[a]}
    return sorted(sorted(group) for group in groups)


def measure() -> dict[str, object]:
    """All figures."""
    names = modules()
    texts = {name: path.read_text(encoding="utf-8") for name, path in names.items()}
    trees = {name: ast.parse(text) for name, text in texts.items()}
    edges = {name: set(imports(trees[name], names)) - {name, "lampyris"} for name in names}
    classes: dict[str, list[str]] = defaultdict(list)
    for name, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                classes[node.name].append(name)
    lines: Counter[str] = Counter()
    for name, text in texts.items():
        lines[".".join(name.split(".")[:2])] += text.count("\n")
    folders = Counter(str(path.parent.relative_to(ROOT)) for path in names.values())
    return {
        "modules": len(names),
        "lines": dict(sorted(lines.items())),
        "crowded": {folder: count for folder, count in sorted(folders.items()) if count > MOST_MODULES},
        "circles": circles(edges),
        "doubled": {name: where for name, where in sorted(classes.items()) if len(where) > 1},
        "old_words": sorted(
            str(path.relative_to(ROOT)) for name, path in names.items() if OLD.search(texts[name])
        ),
    }


def faults(found: Mapping[str, object], kept: frozenset[str]) -> list[str]:
    """What is out of order, a line each."""
    crowded, rings, doubled, words = (found[k] for k in ("crowded", "circles", "doubled", "old_words"))
    assert isinstance(crowded, dict)
    assert isinstance(rings, list)
    assert isinstance(doubled, dict)
    assert isinstance(words, list)
    out = [f"{folder}: {count} modules; at most {MOST_MODULES}" for folder, count in crowded.items()]
    out += [f"import circle: {' -> '.join(ring)}" for ring in rings]
    if len(doubled) > MOST_DOUBLED:
        out.append(
            f"{len(doubled)} class names are defined in several modules; at most {MOST_DOUBLED}: {doubled}"
        )
    out += [f"{file}: words of the old language: {_words(ROOT / file)}" for file in words if file not in kept]
    out += [f"{file}: no old words left; take it out of {KEPT.name}" for file in sorted(kept - set(words))]
    return out


def _words(path: Path) -> str:
    return ", ".join(sorted({found[0] for found in OLD.finditer(path.read_text(encoding="utf-8"))}))


def main() -> int:
    """Print the figures and what is out of order."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--renew", action="store_true", help="write the list of files with old words anew")
    given = parser.parse_args()
    found = measure()
    if given.renew:
        assert isinstance(found["old_words"], list)
        KEPT.write_text("".join(f"{file}\n" for file in found["old_words"]), encoding="utf-8")
    wrong = faults(found, frozenset(KEPT.read_text(encoding="utf-8").split()))
    if given.json:
        print(json.dumps({**found, "faults": wrong}, indent=1))
        return 1 if wrong else 0
    lines = found["lines"]
    assert isinstance(lines, dict)
    for room, count in lines.items():
        print(f"{room:<36}{count:>7} lines")
    print(f"{sum(lines.values()):,} lines in {found['modules']} modules; {len(wrong)} out of order")
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
