"""Files that peakmin may be given: valid specs, valid ones broken at random places, and bytes that mean harm."""

import json
import math
from copy import deepcopy
from functools import cache
from pathlib import Path

from hypothesis import strategies as st

import peakmin as pm

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
VERSION_1 = Path(__file__).parent.parent / "plan" / "version_1"


class Raw(str):
    """JSON text that stands as it is: what no JSON writer writes."""


class Twin(str):
    """A key that may stand in an object a second time."""

    __hash__ = object.__hash__

    def __eq__(self, other):
        return self is other


def text_of(tree):
    """The tree as JSON text, `Raw` leaves and `Twin` keys included."""
    if isinstance(tree, Raw):
        return str(tree)
    if isinstance(tree, dict):
        return "{" + ", ".join(f"{json.dumps(str(key))}: {text_of(value)}" for key, value in tree.items()) + "}"
    if isinstance(tree, list | tuple):
        return "[" + ", ".join(map(text_of, tree)) + "]"
    return json.dumps(tree)


def nested(depth, opening="[", closing="]"):
    return Raw(opening * depth + closing * depth)


LONGEST = 2_000_000  # characters of a list that is repeated


NUMBERS = [
    Raw(text)
    for text in (
        *("0", "-0.0", "1", "-1", "2", "8", "0.5", "1e-9", "1e9", "1e-50", "1e50", "1e99", "1e-99", "1e100", "1e101"),
        *("1e-300", "-1e-300", "1e300", "-1e300", "1e308", "4.9e-324", "1e999", "-1e999", "1e-999", "NaN"),
        *("Infinity", "-Infinity", "1000000", "1000001", "100000", "9007199254740993", "18446744073709551616"),
        *("9" * 310, "9" * 4000, "9" * 10_000, "-" + "9" * 10_000, "0." + "3" * 10_000, "1E+02", "01", "1.", "0x10"),
    )
]
WORDS = [
    Raw(text)
    for text in (
        *('""', '"0"', '"nan"', '"wall"', '"block"', '"arm"', '"exact"', '"kind"', '"SCS"', '"all"', '"unknown"'),
        *('"\\u0000"', '"\\ud800"', '"\\udfff\\ud800"', '"\\u001b[31m"', '"a\\nb"', '"\\u202e\\u2028\\ufeff"'),
        *('"ключ 鍵 🔑"', '"é"', '"e\\u0301"', '"__class__"', '"{0}%s%n"', '"../../etc/passwd"', "'x'", "undefined"),
    )
] + ["x" * 100_000, "\n" * 1000, "🔑" * 1000]
OTHERS = [
    *(None, True, False, [], {}, [[]], [{}], {"": {}}, [None] * 3, [0, 0], [0.0, 0.0, 0.0], [[0, 0]] * 4, {"kind": []}),
    *({"kind": None}, {"kind": {"kind": {}}}, {"kind": "wall"}, {"kind": "block"}, {"0": 0, "1": 1}, [True, False]),
    *([[0, 0], [1, 0], [0, 1]], [[0, 0], [1e-200, 0], [0, 1e-200]], [[0, 0], [1e90, 1], [1, 1e90]], ["a", "b"]),
    *(nested(50), nested(900), nested(20_000), nested(500, '{"a":', "}"), Raw('{"a":' * 20_000), Raw("[0," * 5000)),
    *([[0.1 * k, 0.2] for k in range(2000)], [0] * 20_000, {str(k): k for k in range(5000)}),
]
KEYS = ["", "x", "kind", "arm", "version", "é", "🔑", "\x00", "\x1b[2J", "a\nb", "__init__", "\ud800", "k" * 5000, "0"]


def hostile_values():
    """Numbers of every size, words, wrong types, deep and long things."""
    return st.one_of(
        st.sampled_from(NUMBERS),
        st.sampled_from(WORDS),
        st.sampled_from(OTHERS),
        st.floats().map(lambda x: Raw(repr(x).replace("nan", "NaN").replace("inf", "Infinity"))),
        st.integers(-3, 30),
    )


COORDINATE = st.floats(-2, 2).map(lambda x: round(x, 2))
VECTOR = st.tuples(COORDINATE, COORDINATE).map(list)
LENGTH = st.floats(0.05, 0.6).map(lambda x: round(x, 2))


def settings(searches=("global", "sweep", "refine")):
    """Small ones: a plan in a second or two."""
    search = {
        "global": st.fixed_dictionaries({"kind": st.just("global"), "gap": st.sampled_from([1e-2, 1e-4, 1e-6])}),
        "sweep": st.fixed_dictionaries({"kind": st.just("sweep"), "count": st.integers(1, 4)}),
        "refine": st.fixed_dictionaries({"kind": st.just("refine"), "count": st.integers(1, 3)}),
    }
    return st.fixed_dictionaries(
        {
            "search": st.one_of([search[name] for name in searches]),
            "time_limit": st.sampled_from([0.05, 0.5]),
            "grid": st.fixed_dictionaries(
                {"kind": st.sampled_from(["aligned", "uniform"]), "steps": st.integers(6, 30)}
            ),
        },
        optional={
            "circle": st.sampled_from([{"kind": "disc"}, {"kind": "polygon", "segments": 2, "fit": "circumscribed"}]),
            "method": st.sampled_from([{"kind": "direct"}, {"kind": "bisection", "verified": True}, {"kind": "exact"}]),
            "node_limit": st.integers(1, 20),
            "rounds": st.integers(1, 3),
        },
    )


def walls():
    return st.fixed_dictionaries(
        {"kind": st.just("wall"), "tip": VECTOR},
        optional={"direction": VECTOR, "contact": st.sampled_from(["touch", "clear"]), "opening": LENGTH},
    )


@st.composite
def blocks(draw, sides=("left", "right", "either")):
    """A box or a triangle."""
    (x, y), width, height = draw(VECTOR), draw(LENGTH), draw(LENGTH)
    corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]][: draw(st.integers(3, 4))]
    return {"kind": "block", "vertices": corners, "side": draw(st.sampled_from(sides))}


@st.composite
def specs(draw):
    """A spec of a centre of mass that is valid, or nearly: its walls may be out of order, its blocks in the way."""
    state = st.fixed_dictionaries({"position": VECTOR}, optional={"velocity": VECTOR})
    maneuver = {
        "start": draw(state),
        "goal": draw(state),
        "duration": draw(st.sampled_from([0.5, 1.0, 20.0, 1e-6, 1e6])),
        "obstacles": draw(st.one_of(st.lists(walls(), max_size=3), st.lists(blocks(), min_size=1, max_size=3))),
    }
    bounds = {
        "mass": LENGTH,
        "margin": st.sampled_from([0.0, 0.02]),
        "max_speed": st.sampled_from([0.5, 5.0]),
        "max_peak": st.sampled_from([0.1, 9.0]),
        "region": st.just([[-3, -3], [3, -3], [3, 3], [-3, 3]]),
    }
    maneuver |= draw(st.fixed_dictionaries({}, optional=bounds))
    plain = all(o["kind"] == "wall" for o in maneuver["obstacles"]) and not {"max_speed", "region"} & set(maneuver)
    return {
        "version": 1,
        "maneuver": maneuver,
        "settings": draw(settings(("global", "sweep", "refine") if plain else ("global",))),
    }


@st.composite
def arm_specs(draw):
    """A spec of an arm that is valid, or nearly: its tips may be out of reach, its obstacles in the way."""
    count = draw(st.sampled_from([2, 2, 2, 3]))
    link = st.fixed_dictionaries(
        {"length": st.sampled_from([0.5, 1.0, 1.5]), "mass": LENGTH},
        optional={"com": st.just(0.3), "half_width": st.just(0.02), "limits": st.just([-3, 3]), "max_speed": LENGTH},
    )
    joints = st.fixed_dictionaries({"joints": st.lists(COORDINATE, min_size=count, max_size=count)})
    tips = st.fixed_dictionaries({"tip": VECTOR}, optional={"elbow": st.sampled_from(["up", "down", "either"])})
    pose = st.one_of(joints, tips) if count == 2 else joints
    task = {"start": draw(pose), "goal": draw(pose), "duration": draw(st.sampled_from([0.5, 2.0, 1e4]))}
    bounds = {
        "obstacles": st.lists(blocks(sides=("either",)), max_size=1),
        "margin": st.sampled_from([0.0, 0.01]),
        "max_peak": st.sampled_from([0.1, 5.0]),
    }
    return {
        "version": 1,
        "arm": {"links": [draw(link) for _ in range(count)]},
        "maneuver": task | draw(st.fixed_dictionaries({}, optional=bounds)),
        "settings": draw(settings(("global",))) | {"rounds": draw(st.integers(1, 3))},
    }


def places(tree, path=()):
    """The paths of all that stands in a tree; of long lists the first and last entries."""
    out = [path] if path else []
    if isinstance(tree, dict):
        for key in tree:
            out += places(tree[key], (*path, key))
    elif isinstance(tree, list):
        for k in sorted({*range(min(3, len(tree))), max(len(tree) - 1, 0)} if tree else ()):
            out += places(tree[k], (*path, k))
    return out


def holder(tree, path):
    for key in path[:-1]:
        tree = tree[key]
    return tree


def scaled(value, factor):
    """A number, or all numbers in a list, times a factor; JSON text where the result is no double."""
    if isinstance(value, list):
        return [scaled(one, factor) for one in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    try:
        product = float(value) * factor
    except OverflowError:
        product = math.inf
    return product if math.isfinite(product) else Raw("1e400")


@st.composite
def mutated(draw, trees, most=3):
    """A tree changed at one to three random places."""
    tree = deepcopy(draw(trees))
    for _ in range(draw(st.integers(1, most))):
        every = places(tree)
        if not every:
            break
        path = draw(st.sampled_from(every))
        inside, key = holder(tree, path), path[-1]
        value = inside[key]
        match draw(
            st.sampled_from(["replace"] * 3 + ["scale"] * 2 + ["drop", "twice", "rename", "add", "repeat", "swap"])
        ):
            case "replace":
                inside[key] = deepcopy(draw(hostile_values()))
            case "scale":
                factor = draw(st.sampled_from([0.0, -1.0, 1e300, 1e-300, 1e60, 1e-60, 1e6, 1e-6, 3.0]))
                # a search with all the time in the world would take it
                inside[key] = scaled(value, min(factor, 1.0) if key == "time_limit" else factor)
            case "drop":
                del inside[key]
            case "twice" if isinstance(inside, dict):
                inside[Twin(key)] = deepcopy(draw(st.sampled_from([value, None, 0])))
            case "rename" if isinstance(inside, dict):
                inside[draw(st.sampled_from(KEYS))] = inside.pop(key)
            case "add" if isinstance(inside, dict):
                inside[draw(st.sampled_from(KEYS))] = deepcopy(draw(hostile_values()))
            case "repeat" if isinstance(inside, list):
                times = draw(st.sampled_from([2, 3, 50, 5000]))
                times = min(times, 1 + LONGEST // (1 + len(text_of(inside))))
                inside[:] = [
                    deepcopy(one) for _ in range(times) for one in inside
                ]  # each its own: swaps make no circle
            case "swap":
                other = draw(st.sampled_from(every))
                if other[: len(path)] != path and path[: len(other)] != other:
                    there = holder(tree, other)
                    inside[key], there[other[-1]] = there[other[-1]], value
    return tree


def as_bytes(tree):
    return text_of(tree).encode("utf-8", "surrogatepass")


@st.composite
def hostile_text(draw, trees):
    """A tree's text, cut off, encoded otherwise, or with bytes put in that do not belong there."""
    data = as_bytes(draw(trees))
    at = draw(st.integers(0, max(len(data) - 1, 0)))
    match draw(st.sampled_from(["cut", "insert", "encode", "flip", "wrap", "noise"])):
        case "cut":
            return data[:at]
        case "insert":
            odd = [
                b"\x00",
                b"\xff",
                b"\xc3\x28",
                b"\xed\xa0\x80",
                b"\xef\xbb\xbf",
                b"//",
                b",",
                b"\x1b[31m",
                b"\xe2\x80\xa8",
            ]
            return data[:at] + draw(st.sampled_from(odd)) + data[at:]
        case "encode":
            text = data.decode("utf-8", "replace")
            codecs = ["utf-16", "utf-16-le", "utf-32", "utf-8-sig", "utf-7", "cp037"]
            return text.encode(draw(st.sampled_from(codecs)), "replace")
        case "flip" if data:
            return data[:at] + bytes([data[at] ^ draw(st.sampled_from([1, 2, 16, 32, 128]))]) + data[at + 1 :]
        case "wrap":
            depth = draw(st.sampled_from([1, 100, 2000, 100_000]))
            return b"[" * depth + data + b"]" * depth
    return draw(st.one_of(st.binary(max_size=200), st.text(max_size=200).map(lambda s: s.encode("utf-8", "replace"))))


def broken(trees):
    """Files made of valid trees by changes to the tree, to its text, or both."""
    return st.one_of(
        mutated(trees).map(as_bytes),
        mutated(trees).map(as_bytes),
        mutated(trees, most=1).map(as_bytes),
        hostile_text(st.one_of(trees, mutated(trees))),
    )


def broken_specs():
    return broken(st.one_of(specs(), specs(), arm_specs()))


@cache
def solved():
    """A few plans of peakmin's own, as trees: holds, costates, blocks, a proof of infeasibility, arms, one refused."""
    small = {"grid": {"kind": "aligned", "steps": 8}, "time_limit": 1.0}
    move = {"start": {"position": [0, 0]}, "goal": {"position": [1, 0]}, "duration": 1.0}
    wall, block = {"tip": [0.5, 0.5]}, {"kind": "block", "vertices": [[0.4, -0.2], [0.6, -0.2], [0.5, 0.1]]}
    links = [{"length": 1.0, "mass": 1.0}] * 3
    arm = {"start": {"joints": [0.2, 0.9]}, "goal": {"joints": [0.9, 0.5]}, "duration": 1.0}
    arm3 = {"start": {"joints": [0.2, 0.9, 0.3]}, "goal": {"joints": [0.9, 0.5, 0.1]}, "duration": 1.0}
    asked = [
        {"maneuver": move | {"obstacles": [wall]}, "settings": small},
        {"maneuver": move | {"obstacles": [wall]}, "settings": small | {"search": {"kind": "sweep", "count": 2}}},
        {"maneuver": move | {"obstacles": [wall]}, "settings": {"method": {"kind": "exact"}}},
        {"maneuver": move | {"obstacles": [block], "margin": 0.01}, "settings": small},
        {"maneuver": move | {"max_peak": 3.0}, "settings": small},
        {"maneuver": move | {"obstacles": [wall], "max_speed": 0.1}, "settings": small},
        {"arm": {"links": links[:2]}, "maneuver": arm, "settings": small},
        {"arm": {"links": links}, "maneuver": arm3, "settings": small},
    ]
    out = []
    for spec in asked:
        read = pm.ArmSpec(**spec) if "arm" in spec else pm.Spec(**spec)
        plan = pm.solve(read.task, read.settings)
        out.append(json.loads(plan.to_json()))
    return out


@cache
def first_written():
    """Plan files of version 1."""
    return [json.loads(path.read_text()) for path in sorted(VERSION_1.glob("*.json"))]


def plans():
    """Plan files as peakmin writes them, three of four, and as it first wrote them."""
    now, then = (
        st.sampled_from(range(len(made()))).map(lambda k, made=made: made()[k]) for made in (solved, first_written)
    )
    return st.one_of(now, now, now, then)
