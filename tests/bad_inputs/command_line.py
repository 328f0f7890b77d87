"""Row 99: words of the command line, and files that are already there."""

from __future__ import annotations

from bad_inputs.case import Case

CASES: list[Case] = [
    Case(
        99,
        "unknown option",
        ("plan", "guide", "--nope"),
        code="OPTION",
        exit=2,
        says=("--nope: there is no such option", "`lampyris plan --help`"),
    ),
    Case(99, "unknown verb", ("nope",), code="VERB", exit=2, says=("no verb 'nope'", "plan, ")),
    Case(99, "no map", ("plan",), code="MISSING", exit=2, says=("MAP: nothing is given",)),
    Case(
        99,
        "seed x",
        ("plan", "guide", "--seed", "x"),
        code="TYPE",
        exit=2,
        says=("--seed: 'x'", "a whole number"),
    ),
    Case(
        99,
        "two starts",
        ("plan", "guide", "--start", "0,9", "--start-m", "1,1"),
        code="OPTIONS",
        exit=2,
        says=("--start and --start-m both given", "one of them"),
    ),
    Case(
        99,
        "half a cell",
        ("plan", "guide", "--start", "1.5,2"),
        code="TYPE",
        exit=2,
        says=("--start", "'1.5,2'", "two whole numbers X,Y"),
    ),
    *(
        Case(
            99,
            name,
            words,
            {"there.csv": b"kept", "there.png": b"kept", "there.txt": b"kept"},
            "EXISTS",
            2,
            (words[-1], "the file exists", "--force"),
        )
        for name, words in (
            ("csv there", ("plan", "guide", "--csv", "there.csv")),
            ("picture there", ("plan", "guide", "--picture", "there.png")),
            ("map there", ("maps", "convert", "guide", "there.txt")),
        )
    ),
    Case(
        99,
        "another ending",
        ("maps", "convert", "guide", "map.gif"),
        code="MAP_ENDING",
        exit=2,
        says=("map.gif", "'.gif'", ".png"),
    ),
    Case(
        99,
        "no such folder",
        ("plan", "guide", "--csv", "nowhere/plan.csv"),
        code="FILE_WRITE",
        exit=3,
        says=("nowhere/plan.csv", "a folder you may write in"),
    ),
    *(
        Case(
            99,
            f"misspelt {words[-1]}",
            words,
            code=code,
            exit=exit,
            says=(repr(words[-1]), f"did you mean {right}?"),
        )
        for code, exit, words, right in (
            ("PLANNER", 2, ("plan", "guide", "--planner", "ad-gs"), "ad-gso"),
            ("PRESET", 2, ("plan", "guide", "--preset", "robt"), "robot"),
            ("MOVES", 2, ("plan", "guide", "--moves", "octil"), "octile"),
            ("LAW", 2, ("plan", "guide", "--law", "phisical"), "physical"),
            ("MOBILITY", 2, ("simulate", "guide", "--mobility", "patrl"), "patrol"),
            ("COLOUR", 2, ("plan", "guide", "--colour", "luminence"), "luminance"),
            ("VALUES", 2, ("plan", "guide", "--values", "costmp"), "costmap"),
            ("RECIPE", 2, ("maps", "make", "--out", "new.txt", "mase"), "maze"),
        )
    ),
    Case(
        99,
        "a setting misspelt",
        ("plan", "guide", "--set", "roh=1"),
        code="SETTING",
        exit=2,
        says=("'roh'", "did you mean rho?"),
    ),
    Case(
        99,
        "a name too long",
        ("plan", "guide", "--csv", "x" * 400),
        code="FILE_WRITE",
        exit=3,
        says=("x" * 400,),
    ),
]
