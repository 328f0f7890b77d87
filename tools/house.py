"""Measure the order of the source tree; exit 1 if it is out of order.

    python tools/house.py [--json]

Rules (docs/architecture.md): a folder holds at most 16 modules; no import circle of any kind (at module level,
within functions, for type checkers alone); at most 5 public class names that are defined in several modules;
no word of the first edition's own language in names, comments, texts, pages and keys (of JSON, YAML, CSV and forms),
except in the files that are listed in tools/old_words.txt, which may only become fewer.
"""

from __future__ import annotations

import argparse
import ast
import gc
import io
import json
import re
import sys
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {
    "lampyris": ROOT / "src" / "lampyris",
    "lampyris_selfcheck": ROOT / "selfcheck/src/lampyris_selfcheck",
}
KEPT = ROOT / "tools" / "old_words.txt"
MOST_MODULES = 16
MOST_DOUBLED = 5
# The rename table of the second edition: what a name was, and what it is now.
CLASSES = {
    "Cutter": "Adversary", "Feed": "Sensor", "Going": "Trajectory", "Ground": "StudyMap", "Grounds": "FieldCache",
    "Guide": "Replanner", "Halted": "Cancelled", "Hands": "Executor", "Here": "SerialExecutor", "Hold": "StoreLock",
    "Lie": "RejectedResult", "Movers": "ObstacleStates", "Others": "ObstacleSet", "Seen": "ObstacleTrack",
    "Stretch": "Segment", "Told": "ObstacleMessage", "Way": "Path", "Ways": "Paths", "Where": "KeyPath",
    "Who": "Config",
}  # fmt: skip
"""Names, as they are spelt here: in lower case most of them are plain English."""
PARTS = {
    "bends": "fillets, corners", "bodies": "obstacles", "course": "samples", "courses": "samples",
    "crowd": "traffic", "crowds": "traffic_cases", "feed": "sensor", "feeds": "sensors",
    "halted": "stopped", "halting": "stopping", "mended": "repaired", "mover": "obstacle",
    "movers": "obstacle_states", "roomy": "smoothing", "stroller": "random_walker", "strollers": "random_walkers",
    "taut": "pulled straight", "told": "what the value is", "twin": "reference", "twins": "references",
    "unheard": "shielded", "way": "path, key_path", "ways": "paths",
}  # fmt: skip
"""Parts of names and of keys."""
WORDS = {
    "anew": "again, from scratch, re-", "any ?body": "anyone, any obstacle", "bod(?:y|ies)": "obstacle",
    "careful": "safe_controller", "changes? of mind": "path switch", "crowd(?:s|ed|ing)?": "traffic, dense",
    "cutters?": "adversary", "dear(?:er|est)?": "costly", "every ?body": "everyone, all obstacles",
    "flips": "path_switches", "for ever": "forever", "go(?:es|ne)? on with": "continue, resume",
    "guests?": "third-party planner", "halting": "cancellation", "held by": "limited by",
    "keep_away": "min_clearance", "kept_in": "cache_folder", "lat_max": "a_lat_max", "look_at": "checkpoint",
    "mend(?:s|ed|ers?|ing)?": "repair", "movers?": "obstacle", "rivals?": "baseline", "roomy(?:_\\w+)?": "smoothing",
    "some ?body": "someone, an obstacle", "strangers?": "untrusted", "strollers?": "random walkers",
    "taut": "pulled straight", "the house": "the architecture", "told": "given, reported", "twins?": "reference",
    "unheard": "shielded", "warmth": "traffic_density_weight", "whoever": "what does it",
    "(?:cheapest|fastest|planned|shortest|whole) ways?": "path", "ways? through (?:obstacles|walls)": "path",
}  # fmt: skip
"""Words of comments, docstrings, messages and pages."""
FORMER = re.compile(
    r"\b(?:strollers?|unheard|whoever|dearer|roomy(?:_\w+)?|twins?|held by|told of|begins? anew|go(?:es|ne)? on with"
    r"|mend(?:s|ed|ers?|ing)?|crowd|the house|halting|look_at|kept_in|lat_max|flips|crowding|warmth|keep_away)\b"
)
"""The shorter list for the checks."""
OLD = re.compile(rf"\b(?:{'|'.join(WORDS)})\b", re.IGNORECASE)
PLAIN = re.compile(
    r"``[^`]*``|`[^`]*`|--[\w-]+"
    r"|(?:HTTP|[Mm]essage|[Rr]equest|[Rr]esponse|its|whose|Kind and) bod(?:y|ies)|rigid\s+body|address, body"
    r"|</?body>|body \{|len\(body\)|cutter\.\{"
    r"|bod(?:y|ies) (?:apart|outside|size|speed|step|wall|\{)|(?:un)?told contact",
    re.MULTILINE,
)
"""Where such a word is another: code and options; bodies in HTTP, HTML and PNG; names of the referee's rules."""
GENERATED = frozenset({"benchmarks.md", "licences.md"})
HTTP = ("src/lampyris/app/server/", "docs/threats.md")
"""Where a body is that of a request or an answer."""


def modules() -> dict[str, Path]:
    """Every module by its dotted name."""
    found = {}
    for package, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*.py")):
            parts = (package, *path.relative_to(folder).with_suffix("").parts)
            found[".".join(parts).removesuffix(".__init__")] = path
    return found


@cache
def nodes(text: str) -> tuple[list[ast.stmt], list[ast.Import | ast.ImportFrom], set[str]]:
    """Of a module: its statements, its imports, wherever they are, and its strings of one word."""
    tree = ast.parse(text)
    imported: list[ast.Import | ast.ImportFrom] = []
    words = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant):
            if isinstance(node.value, str) and _WORD.fullmatch(node.value):
                words.add(node.value)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            imported.append(node)
    return tree.body, imported, words


def imports(text: str, names: Mapping[str, Path]) -> Iterator[str]:
    """Modules of ours that a module imports, wherever it does."""
    for node in nodes(text)[1]:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in names)
        elif node.module and not node.level:
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
    edges = {name: set(imports(text, names)) - {name, "lampyris"} for name, text in texts.items()}
    classes: dict[str, list[str]] = defaultdict(list)
    for name, text in texts.items():
        for node in nodes(text)[0]:
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
            str(path.relative_to(ROOT)) for path in (*names.values(), *pages(), *keyed()) if old_words(path)
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
    out += [
        f"{file}: words of the old language: {', '.join(old_words(ROOT / file))}"
        for file in words
        if file not in kept
    ]
    out += [f"{file}: no old words left; take it out of {KEPT.name}" for file in sorted(kept - set(words))]
    return out


def pages() -> list[Path]:
    """The pages that are written by hand."""
    docs = (path for path in (ROOT / "docs").rglob("*.md") if path.name not in GENERATED)
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(docs)]


def keyed() -> list[Path]:
    """Scripts of the app, schemas and bundled studies: only their keys and names are looked at."""
    source = ROOT / "src" / "lampyris"
    return [
        *sorted(source.rglob("*.js")),
        *sorted((ROOT / "docs").glob("*.schema.json")),
        *sorted(source.rglob("*.yaml")),
    ]


def old_words(path: Path) -> list[str]:
    """Words of the first edition in a module or a page, each once."""
    text = path.read_text(encoding="utf-8")
    if path.is_relative_to(ROOT / "selfcheck"):
        return sorted({found[0] for found in FORMER.finditer(text)})
    if path.suffix in _KEYS:
        return sorted(key for key in keys(path, text) if _is_old(key))
    names, texts = _parts(text) if path.suffix == ".py" else ([], [_prose(text)])
    old = {name for name in names if name in CLASSES or _is_old(name)}
    old |= {key for key in keys(path, text) if _is_old(key)}
    for one in texts:
        old.update(found[0] for found in OLD.finditer(PLAIN.sub(" ", one)))
    if path.is_relative_to(ROOT) and str(path.relative_to(ROOT)).startswith(HTTP):
        old -= {"body", "Body", "bodies", "Bodies"}
    return sorted(old)


@cache
def _is_old(name: str) -> bool:
    return bool(PARTS.keys() & {part.lower() for part in _PART.findall(name)})


def keys(path: Path, text: str) -> set[str]:
    """Words that a user meets as keys: of dicts, JSON, YAML, CSV columns, options and forms.

    Of a module or a script every string of one word (a key and its use are spelt alike); of JSON and YAML the keys.
    """
    if path.suffix == ".py":
        return nodes(text)[2]
    return (
        {found[1] or found[2] for found in _KEYS[path.suffix].finditer(text)}
        if path.suffix in _KEYS
        else set()
    )


_WORD = re.compile(r"-{0,2}[A-Za-z]\w*(?:[.-]\w+)*")
_KEYS = {
    ".js": re.compile(r"""["'`](-{0,2}[A-Za-z]\w*(?:[.-]\w+)*)["'`]()"""),
    ".json": re.compile(r'"(\w+)":()'),
    ".yaml": re.compile(r"^[ -]*(\w+):|[{,] *(\w+):", re.MULTILINE),
}
_PART = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_KEY = re.compile(r"""[a-z]*(["']{1,3})[\w./:-]*\1""", re.IGNORECASE)
"""A string of one word: a key or a name, judged as those are; see :func:`keys`."""


def _parts(source: str) -> tuple[list[str], list[str]]:
    """Names of a module; its comments and the strings that are texts."""
    names, texts = [], []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NAME:
            names.append(token.string)
        elif token.type == tokenize.COMMENT or (
            token.type == tokenize.STRING and not _KEY.fullmatch(token.string)
        ):
            texts.append(token.string)
    return names, texts


def _prose(page: str) -> str:
    """A page without code, targets of links, generated tables and recorded figures."""
    page = re.sub(r"<!-- tables -->.*?<!-- end of tables -->", "", page, flags=re.DOTALL)
    page = re.sub(r"^```.*?^```", "", page, flags=re.DOTALL | re.MULTILINE)
    page = re.sub(r"^ {4}.*$|^ *- (?:seen:|commit,|nightly,|release,).*$", "", page, flags=re.MULTILINE)
    return re.sub(r"\]\([^)]*\)", "]", page)


def main() -> int:
    """Print the figures and what is out of order."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--renew", action="store_true", help="rewrite the list of files with old words")
    given = parser.parse_args()
    gc.disable()  # millions of nodes that all stay: looking for garbage among them takes as long as the rest
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
