"""Linear programs against second-order cones: value, time, growth in n and in the number of holds N."""

import resource

import pytest

import peakmin as pm
from peakmin import paper
from peakmin.programs.least_peak import LeastPeak

MANEUVER = paper.GENERAL.model_copy(update={"duration": 1.0})
DISC = {"kind": "disc"}
CIRCLES = {"disc": DISC} | {f"n = {n}": {"kind": "polygon", "segments": n} for n in (1, 2, 3, 4, 5, 10, 20)}


def compiled(circle, steps):
    peak = LeastPeak(MANEUVER, pm.Settings(circle=circle, grid={"kind": "aligned", "steps": steps}))
    peak([0.45])  # compiles
    return peak


@pytest.mark.parametrize("steps", [50, 200, 800])
@pytest.mark.parametrize("name", CIRCLES)
def test_circle(benchmark, name, steps):
    peak = compiled(CIRCLES[name], steps)

    def solve():
        peak._known.clear()
        return peak([0.5])

    bracket = benchmark.pedantic(solve, rounds=5)
    benchmark.extra_info.update(
        group=f"N = {steps}", name=name, value=bracket.upper * peak.mass.unit, width=bracket.gap
    )


@pytest.mark.parametrize("steps", [200, 2000, 20_000])
def test_growth(benchmark, steps):
    def compile_and_solve():
        return LeastPeak(MANEUVER, pm.Settings(circle=DISC, grid={"kind": "aligned", "steps": steps}))([0.5])

    bracket = benchmark.pedantic(compile_and_solve, rounds=3, warmup_rounds=1)
    benchmark.extra_info.update(
        group="compile and solve, disc",
        name=f"N = {steps}",
        value=bracket.upper,
        width=bracket.gap,
        mebibytes=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    )
