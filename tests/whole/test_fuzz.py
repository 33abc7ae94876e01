"""Whatever the file, the terminal gives one clear line or a plan that passes its own check, in time and in memory.

`make test` tries a few hundred files, always the same; `make fuzz` tens of thousands, others every time, and prints their
seed and what became of them.
"""

import contextlib
import io
import json
import math
import os
import random
import resource
import signal
import time
from collections import Counter

import hypothesis
import pytest
from hypothesis import HealthCheck, Phase
from hypothesis import strategies as st

import peakmin as pm
from peakmin import cli
from peakmin.spec.reading import MOST_DEEP, MOST_KEYS, MOST_PARTS
from peakmin.spec.spec import read_spec
from tests.whole import strategies

COUNT = int(os.environ.get("PEAKMIN_FUZZ", "120"))  # files altogether
SEED = int(os.environ.get("PEAKMIN_FUZZ_SEED", "1"))
MOST_SECONDS = 60  # of the processor for one file, unless it asks for a search without a time limit of a second
MOST_BYTES = 2 * 2**30
LONGEST = 500  # characters of a refusal
PARTS = 10  # of each kind of files: what the processes share among them
FILES = {  # the share of each kind, its strategy and what is done with it
    "broken specs": (0.58, strategies.broken_specs(), ["solve"] * 8 + ["sweep", "budget", "compare", "verify"]),
    "broken plans": (0.39, strategies.broken(strategies.plans()), ["verify"] * 8 + ["solve", "simulate"]),
    "specs": (0.025, strategies.specs().map(strategies.as_bytes), ["solve", "solve", "sweep"]),
    "arms": (0.005, strategies.arm_specs().map(strategies.as_bytes), ["solve"]),
}


class TooLongError(BaseException):
    """Not an Exception: nothing on the way takes it for one of its own."""


def called(arguments):
    """Exit status, stdout and stderr of the terminal in this process, which is stopped after MOST_SECONDS."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))

    def stop(*_):
        raise TooLongError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as end:
            cli.main([str(a) for a in arguments])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    return end.value.code, out.buffer.getvalue().decode(), err.buffer.getvalue().decode()


def largest():
    """The most memory that this process has had [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def must_be_right(verb, status, out, err):
    """One clear line, or a plan that is what it says."""
    if status == 2:
        line = err.removesuffix("\n")
        assert out == ""
        assert line.startswith("peakmin: ")
        assert line.isprintable()
        assert "Traceback" not in line
        assert len(line) <= LONGEST
        return
    assert status in (0, 3, 4)
    assert err == ""
    document = json.loads(out)
    if verb not in ("solve", "sweep"):
        return
    found = pm.verify(json.dumps(document.get("best", document)))
    assert found.problems == ()
    plan = found.plan
    assert plan.status in {0: ("solved", "feasible"), 3: ("infeasible",), 4: ("unknown",)}[status]
    # a path that enters an obstacle may well be cheaper than every free one; then the gap is stated as 1
    assert not plan.keeps or plan.lower_bound <= plan.peak * (1 + 1e-9)
    assert plan.gap == 1 or plan.lower_bound <= plan.peak * (1 + 1e-9)


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("kind", FILES)
def test_any_file_gives_one_clear_line_or_a_checked_plan(kind, part, tmp_path, record_property):
    share, files, verbs = FILES[kind]
    ends, slowest, path = Counter(), 0.0, tmp_path / "file.json"
    seed = 1000 * SEED + 10 * list(FILES).index(kind) + part
    chance = random.Random(seed)

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=max(round(share * COUNT / PARTS), 1),
        derandomize=False,
        database=None,
        deadline=None,
        phases=[Phase.generate],  # what fails is printed as it is: making it smaller would take hours
        suppress_health_check=list(HealthCheck),
    )
    @hypothesis.given(files, st.sampled_from(verbs))
    def one(data, verb):
        nonlocal slowest
        path.write_bytes(data)
        began = time.process_time()
        try:
            status, out, err = called([verb, path, "--json"])
        except TooLongError:
            assert verb in ("solve", "sweep", "budget", "compare")
            assert (read_spec(path).settings.time_limit or math.inf) > 1
            ends["stopped, as they set no time limit"] += 1
            return
        slowest = max(slowest, time.process_time() - began)
        assert largest() <= MOST_BYTES
        must_be_right(verb, status, out, err)
        if verb == "verify" and status != 2:
            assert json.loads(out)["verified"] == (status == 0)
        if chance.random() < 0.1:  # in words, too
            with contextlib.suppress(TooLongError):
                again, out, err = called([verb, path])
                assert again in ((2,) if status == 2 else (0, 3, 4))
                assert (out == "", err == "") == ((True, False) if status == 2 else (False, True))
        ends[{0: "done", 2: "refused", 3: "infeasible", 4: "not proved or not as stated"}[status]] += 1

    one()
    record_property("fuzz", json.dumps({"kind": kind, "ends": ends, "slowest": slowest, "memory": largest()}))


def big(what):
    """Files of many megabytes, and those that ask for much work in few words."""
    move = '"start": {"position": [0, 0]}, "goal": {"position": [1, 0]}, "duration": 1'
    wall = '{"tip": [%r, 0.5]}'
    block = '{"kind": "block", "vertices": [[%r, 1], [%r, 1], [%r, 2]]}'
    many = range(1, 5001)

    def moving(obstacles, settings=""):
        return '{"maneuver": {%s, "obstacles": [%s]}%s}' % (move, obstacles, settings)  # noqa: UP031

    def block_of(vertices):
        return json.dumps({"kind": "block", "vertices": vertices})

    return {
        "a string of 100 MB": lambda: '{"maneuver": "%s"}' % ("x" * 10**8),
        "a string of 60 MB": lambda: '{"maneuver": "%s"}' % ("x" * 6 * 10**7),
        "a string of 60 MB of escapes": lambda: '{"maneuver": {"%s": 1}}' % ("\\u0000" * 10**7),
        "a million brackets": lambda: "[" * 10**6 + "]" * 10**6,
        "60 MB of lists": lambda: '{"maneuver": [%s[]]}' % ("[]," * 2 * 10**7),
        "60 MB of lists in lists": lambda: '{"maneuver": [%s[]]}' % ("[[[[[[]]]]]]," * 4 * 10**6),
        "60 MB of numbers": lambda: '{"maneuver": [%s0]}' % ("1e9," * 15 * 10**6),
        "60 MB of words": lambda: '{"maneuver": [%s0]}' % ('"ab",' * 12 * 10**6),
        "many keys": lambda: "{" + ",".join(f'"{k:x}":0' for k in range(4 * 10**6)) + "}",
        "keys twice": lambda: "{" + ",".join(f'"{k:x}":0' for k in range(10**6)) + ',"f423f":1}',
        "numbers for obstacles": lambda: moving(",".join(["0"] * 10**7)),
        "digits": lambda: '{"version": %s}' % ("9" * 6 * 10**7),
        "5000 walls": lambda: moving(",".join(wall % (k / 5001) for k in many)),
        "5000 walls in a sweep": lambda: moving(
            ",".join(wall % (k / 5001) for k in many),
            ', "settings": {"search": {"kind": "sweep", "count": 5000}, "grid": {"kind": "uniform", "steps": 9000}}',
        ),
        "5000 blocks": lambda: moving(",".join(block % (k, k + 0.5, k) for k in many)),
        "blocks of 1000 corners": lambda: moving(
            ",".join(block_of([[k + j / 1000, 1 + (j - 500) ** 2] for j in range(1000)]) for k in range(5))
        ),
        "a million steps": lambda: moving("", ', "settings": {"grid": {"kind": "aligned", "steps": 1000000}}'),
        "40000 edges": lambda: moving("", ', "settings": {"circle": {"kind": "polygon", "segments": 10000}}'),
    }[what]().encode()


BIG = [
    *("a string of 100 MB", "a string of 60 MB", "a string of 60 MB of escapes", "a million brackets"),
    *("60 MB of lists", "60 MB of lists in lists", "60 MB of numbers", "60 MB of words", "many keys", "keys twice"),
    *("numbers for obstacles", "digits", "5000 walls", "5000 walls in a sweep", "5000 blocks"),
    *("blocks of 1000 corners", "a million steps", "40000 edges"),
]
LITTLE = [*BIG[3:4], *BIG[-6:]] if COUNT < 10_000 else BIG


@pytest.mark.parametrize("verb", ["solve", "verify"])
@pytest.mark.parametrize("what", LITTLE)
def test_what_is_too_much_is_refused_in_little_time_and_memory(what, verb, tmp_path):
    path = tmp_path / "file.json"
    path.write_bytes(big(what))
    status, out, err = called([verb, path])
    assert status == 2
    must_be_right(verb, status, out, err)
    assert largest() <= MOST_BYTES


@pytest.mark.parametrize("path", ["none\n.json", "none\x1b[2J.json"])
def test_odd_file_names_stay_on_one_line(path):
    status, out, err = called(["solve", path])
    assert status == 2
    must_be_right("solve", status, out, err)
    assert "none" in err
    with pytest.raises(pm.SpecError, match=r"^none\x00.json: cannot be read"):
        pm.Spec.read("none\x00.json")


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("[" * (MOST_PARTS + 1), f"was {MOST_PARTS + 1} lists and objects, must be at most {MOST_PARTS}"),
        ('{"a": ' * (MOST_DEEP + 1) + "0" + "}" * (MOST_DEEP + 1), "was nested too deeply, must be at most"),
        (json.dumps({str(k): k for k in range(MOST_KEYS + 1)}), f"of {MOST_KEYS + 1} keys, must have at most"),
    ],
)
def test_documents_have_stated_limits(text, names):
    with pytest.raises(pm.SpecError) as error:
        pm.Spec.from_json(text)
    assert str(error.value).startswith("the document: was ")
    assert names in str(error.value)


STRAIGHT = {"start": {"position": [0, 0]}, "goal": {"position": [1, 0]}, "duration": 1.0}
TRIANGLE = {"kind": "block", "vertices": [[0.4, 1], [0.6, 1], [0.6, 2]]}


@pytest.mark.parametrize(
    ("changes", "settings", "names"),
    [
        ({"obstacles": [TRIANGLE] * 101}, {}, "maneuver.obstacles: was a list of 101, must be a list of at most 100"),
        ({"obstacles": [0] * 101}, {}, "maneuver.obstacles: was a list of 101, must be a list of at most 100"),
        ({"region": [[0, 0]] * 101}, {}, "maneuver.region: was a list of 101, must be a list of at most 100"),
        (
            {},
            {"grid": {"steps": 400_000, "kind": "aligned"}},
            "settings.grid.steps: was 400000, must be at most 333333 for this disc",
        ),
        ({}, {"circle": {"kind": "polygon", "segments": 1000}}, None),
        (
            {},
            {"circle": {"kind": "polygon", "segments": 10_000}},
            "settings.grid.steps: was 200, must be at most 25 for this polygon",
        ),
    ],
)
def test_specs_have_stated_limits(changes, settings, names):
    text = json.dumps({"maneuver": STRAIGHT | changes, "settings": settings})
    with contextlib.nullcontext() if names is None else pytest.raises(pm.SpecError) as error:
        pm.Spec.from_json(text)
    assert names is None or str(error.value).startswith(names)


def test_corners_are_counted_over_all_blocks():
    around = [[k / 1000, 1 + (k / 1000 - 0.5) ** 2] for k in range(1000)]
    obstacles = [{"kind": "block", "vertices": [[x, y + i] for x, y in around]} for i in range(3)]
    pm.Spec(maneuver=STRAIGHT | {"obstacles": obstacles[:2]})
    with pytest.raises(pm.SpecError, match=r"^maneuver\.obstacles: was .*must be blocks of at most 2000 corners"):
        pm.Spec(maneuver=STRAIGHT | {"obstacles": obstacles})
