"""Draw the house of docs/architecture.md from the imports that the code really has: python docs/house.py

Floors stand on what they may take from. A riser goes down from each floor, with a dot on every floor and every library
below that one of its modules imports; imports that only type checkers follow are left out. A brick closes a riser where
a wall is; a dot in red is an import that the house does not allow.
"""

from __future__ import annotations

import ast
import textwrap
from html import escape
from pathlib import Path

import grimp

HERE = Path(__file__).parent
PACKAGE = HERE.parent / "peakmin"
FLOORS = ("roof", "view", "queries", "search", "plan", "scenes", "programs", "proofs", "spec", "robots", "geometry")
GROUND = ("types", "errors", "deadline", "files", "byname")
LIBRARIES = {"shapely": "polygons", "cvxpy": "and its solvers", "matplotlib": "figures"}
WALLS = (  # who takes nothing from where
    (("plan", "scenes", "proofs"), ("search", "programs")),
    (tuple(floor for floor in FLOORS if floor != "programs"), ("cvxpy",)),
    (tuple(floor for floor in FLOORS if floor not in ("roof", "view")), ("matplotlib",)),
    (("proofs", "geometry"), ("shapely",)),
)
KINDS = {"proofs": "exact", "scenes": "exact", "plan": "exact", "programs": "solves", "search": "solves"}
COLOURS = {  # fill, line
    "exact": ("#dcebf5", "#0072b2"),
    "solves": ("#fbe9d7", "#c65d00"),
    "": ("#f0efea", "#5b5b57"),
}
INK, FAINT, BROKEN, BRICK, EARTH = "#222222", "#d9d7d0", "#c8102e", "#b5653c", "#d8cfbf"
LEFT, WIDTH, RISERS, STEP = 52, 530, 650, 42
TOP, GABLE, HEIGHT, LOW = 96, 104, 56, 34


def floor_of(module: str, packages: set[str]) -> str:
    """The floor that a module of peakmin stands on, or the library that it is of."""
    first, _, rest = module.partition(".")
    if first != "peakmin":
        return first
    name = rest.split(".")[0]
    return name if name in packages else "ground" if name in GROUND else "roof"


def imports() -> set[tuple[str, str]]:
    """Which floor takes from which floor or library."""
    packages = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert packages == set(FLOORS) - {"roof"}, f"floors: {packages ^ set(FLOORS)}"
    graph = grimp.build_graph(
        "peakmin", include_external_packages=True, exclude_type_checking_imports=True, cache_dir=None
    )
    there = {
        (floor_of(module, packages), floor_of(taken, packages))
        for module in graph.modules
        if module.startswith("peakmin")
        for taken in graph.find_modules_directly_imported_by(module)
    }
    known = {*FLOORS, "ground", *LIBRARIES}
    return {(one, other) for one, other in there if one != other and other in known}


def words(floor: str) -> list[str]:
    """What a floor is, in its own words: two lines at most."""
    if floor in ("roof", "ground"):
        there = sorted(path.stem for path in PACKAGE.glob("[!_]*.py"))
        return [", ".join(name for name in there if (name in GROUND) == (floor == "ground"))]
    text = ast.get_docstring(ast.parse((PACKAGE / floor / "__init__.py").read_text())) or ""
    return textwrap.wrap(text.split("\n\n")[0], 56)[:2]


def text(x: float, y: float, content: str, size: float, **style: str) -> str:
    own = "".join(f' {name.replace("_", "-")}="{value}"' for name, value in {"fill": INK, **style}.items())
    return f'<text x="{x:g}" y="{y:g}" font-size="{size:g}"{own}>{escape(content)}</text>'


def drawn() -> str:
    """The drawing, as SVG."""
    taken = imports()
    rows = [*FLOORS, "ground", *LIBRARIES]
    tops = [TOP, *(TOP + GABLE + HEIGHT * k for k in range(len(FLOORS)))]
    below = tops[-1] + HEIGHT + 40
    tops += [below + LOW * k for k in range(len(LIBRARIES))]
    middle = {
        row: top + (GABLE - 30 if row == "roof" else (LOW if row in LIBRARIES else HEIGHT) / 2)
        for row, top in zip(rows, tops, strict=True)
    }
    right, last = RISERS + STEP * (len(FLOORS) - 1) + 66, below + LOW * len(LIBRARIES)
    wide, high = right + 24, last + 62
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide:g} {high:g}" width="{wide:g}" height="{high:g}" '
        'font-family="Helvetica Neue, Helvetica, Arial, Liberation Sans, DejaVu Sans, sans-serif">',
        f'<rect width="{wide:g}" height="{high:g}" rx="14" fill="#fdfcf9"/>',
        text(LEFT - 16, 44, "The house", 26, font_weight="bold"),
        text(
            LEFT - 16,
            68,
            "A floor takes from those below it only. What it takes hangs on the riser under its ring.",
            14,
        ),
    ]
    # the house
    for row, top in zip(rows, tops, strict=True):
        fill, line = COLOURS[KINDS.get(row, "")]
        y = middle[row]
        if row == "roof":
            gable = f"{LEFT - 18},{top + GABLE} {LEFT + WIDTH / 2},{top} {LEFT + WIDTH + 18},{top + GABLE}"
            chimney = f'x="{LEFT + WIDTH - 120}" y="{top + 6}" width="26" height="56"'
            out += [
                f'<rect {chimney} fill="{fill}" stroke="{line}" stroke-width="1.5"/>',
                f'<polygon points="{gable}" fill="{fill}" stroke="{line}" stroke-width="1.5" stroke-linejoin="round"/>',
                text(LEFT + WIDTH / 2, y - 8, row, 17, font_weight="bold", text_anchor="middle"),
                text(LEFT + WIDTH / 2, y + 12, words(row)[0], 12.5, text_anchor="middle"),
            ]
        elif row in LIBRARIES:
            out += [
                text(LEFT, y + 5, row, 14, font_weight="bold", fill="#5b5b57"),
                text(LEFT + 106, y + 5, LIBRARIES[row], 12.5, fill="#5b5b57"),
            ]
        elif row == "ground":
            out += [
                f'<rect x="{LEFT - 18}" y="{top}" width="{right - LEFT + 18}" height="{HEIGHT}" fill="{EARTH}"/>',
                text(LEFT + 18, y + 5, row, 17, font_weight="bold"),
                text(LEFT + 124, y + 5, words(row)[0], 12.5),
            ]
        else:
            lines = words(row)
            out += [
                f'<rect x="{LEFT}" y="{top}" width="{WIDTH}" height="{HEIGHT}" fill="{fill}" stroke="{line}" '
                'stroke-width="1.5"/>',
                f'<rect x="{LEFT}" y="{top}" width="7" height="{HEIGHT}" fill="{line}"/>',
                text(LEFT + 18, y + 6, row, 17, font_weight="bold"),
                *(
                    text(LEFT + 124, y + 4.5 + 16 * (k - (len(lines) - 1) / 2), part, 12.5)
                    for k, part in enumerate(lines)
                ),
            ]
        if row != "ground":
            out.append(
                f'<line x1="{RISERS - 40}" y1="{y:g}" x2="{right:g}" y2="{y:g}" stroke="{FAINT}" stroke-width="1"/>'
            )
    out.append(text(LEFT, below - 10, "from outside", 12.5, font_style="italic", fill="#5b5b57"))
    # the risers
    for k, floor in enumerate(FLOORS):
        x, line = RISERS + STEP * k, COLOURS[KINDS.get(floor, "")][1]
        reached = [row for row in rows if (floor, row) in taken]
        closed = {row for floors, wall in WALLS if floor in floors for row in wall}
        broken = {row for row in reached if row in closed or rows.index(row) < rows.index(floor)}
        ends = [middle[row] for row in (floor, *reached)]
        out.append(
            f'<line x1="{x}" y1="{min(ends):g}" x2="{x}" y2="{max(ends):g}" stroke="{line}" stroke-width="2.5" '
            'stroke-linecap="round"/>'
        )
        out += [
            f'<rect x="{x - 8}" y="{middle[row] - 4:g}" width="16" height="8" rx="1.5" fill="{BRICK}" '
            'stroke="#fdfcf9" stroke-width="1.5"/>'
            for row in rows[rows.index(floor) :]
            if row in closed - broken
        ]
        out += [
            f'<circle cx="{x}" cy="{middle[row]:g}" r="6" fill="{BROKEN if row in broken else line}"/>'
            for row in reached
        ]
        out.append(f'<circle cx="{x}" cy="{middle[floor]:g}" r="7.5" fill="#fdfcf9" stroke="{line}" stroke-width="3"/>')
        out.append(text(x + 12, middle[floor] - 8, floor, 12, fill=line))
    # what the marks mean
    y = last + 34
    legend = [("exact", "arithmetic decides"), ("solves", "solvers propose")]
    x = LEFT
    for kind, meaning in legend:
        fill, line = COLOURS[kind]
        out += [
            f'<rect x="{x}" y="{y - 11}" width="18" height="14" fill="{fill}" stroke="{line}" stroke-width="1.5"/>',
            text(x + 26, y, meaning, 12.5),
        ]
        x += 165
    out += [
        f'<circle cx="{x + 8}" cy="{y - 4}" r="6" fill="#5b5b57"/>',
        text(x + 22, y, "takes from this floor", 12.5),
        f'<rect x="{x + 184}" y="{y - 8}" width="16" height="8" rx="1.5" fill="{BRICK}"/>',
        text(x + 208, y, "a wall: never from this one", 12.5),
    ]
    if any(BROKEN in one for one in out):
        out += [
            f'<circle cx="{x + 404}" cy="{y - 4}" r="6" fill="{BROKEN}"/>',
            text(x + 418, y, "not allowed, to be mended", 12.5),
        ]
    out.append("</svg>")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    (HERE / "house.svg").write_text(drawn())
