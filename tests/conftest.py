import json
import os
import shutil
import signal
import tempfile
from collections import Counter
from pathlib import Path

import hypothesis
import matplotlib

import peakmin as pm

matplotlib.use("Agg")
ALL = os.environ.get("PEAKMIN_SEEDS") == "all"  # `make proofs`: every seed of what `make test` takes some of
# in the background of a script Ctrl-C is ignored, also by the processes that tests start and stop in this way
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# the same examples every time: a failure in `make test` is the change's, not the day's
hypothesis.settings.register_profile("repeatable", derandomize=True, deadline=None)
hypothesis.settings.load_profile("repeatable")


def wall_maneuver(contact="clear", **changes):
    """The paper's general problem, T = 1."""
    return pm.Maneuver(
        **{
            "start": pm.State(position=(0, 0)),
            "goal": pm.State(position=(1, 0)),
            "duration": 1.0,
            "obstacles": (pm.Wall(tip=(0.5, 0.5), contact=contact),),
            **changes,
        }
    )


def least(maneuver, times=(), **settings):
    """Bracket [m/s^2] at given obstacle times, as (lower, upper)."""
    from peakmin.programs.least_peak import LeastPeak

    peak = LeastPeak(maneuver, pm.Settings(**settings))
    bracket = peak(times)
    unit = peak.mass.unit
    return bracket.lower * unit, bracket.upper * unit


def pytest_sessionfinish(session):
    """What the run's processes have shared goes."""
    if run := session.config.pluginmanager.getplugin("dsession"):  # none in the processes themselves
        shutil.rmtree(shared(run.nodemanager.testrunuid), ignore_errors=True)


def shared(run):
    """Where the processes of a run keep the plans that they share (`tests.solved`)."""
    return Path(tempfile.gettempdir()) / f"peakmin-tests-{run}"


def pytest_terminal_summary(terminalreporter):
    """What became of the fuzzed files, over all processes."""
    found = [
        json.loads(value)
        for report in terminalreporter.getreports("passed")
        for name, value in report.user_properties
        if name == "fuzz"
    ]
    if not found or os.environ.get("PEAKMIN_FUZZ") is None:
        return
    terminalreporter.section(f"fuzz, PEAKMIN_FUZZ_SEED={os.environ.get('PEAKMIN_FUZZ_SEED', '1')}")
    for kind in dict.fromkeys(one["kind"] for one in found):
        of_kind = [one for one in found if one["kind"] == kind]
        ends = sum((Counter(one["ends"]) for one in of_kind), Counter())
        said = ", ".join(f"{count} {end}" for end, count in ends.most_common())
        slowest, most = (max(one[name] for one in of_kind) for name in ("slowest", "memory"))
        terminalreporter.line(
            f"{kind}: {sum(ends.values())} files, {said}; slowest {slowest:.1f} s, {most / 2**20:.0f} MiB"
        )
