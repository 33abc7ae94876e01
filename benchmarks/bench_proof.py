"""The certified minimum over all obstacle times against IPOPT's local one, and the exact method against SOCP."""

import numpy as np
import pytest

import peakmin as pm
from peakmin.paper import GENERAL, STEP, TWO_LINK, obstacle_nodes
from peakmin.proofs.branch_and_bound import least_over_times
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal

TRUE = GENERAL.model_copy(update={"duration": 1.0})  # the paper's problem, without the step that its table leaves out
TWO = TRUE.model_copy(update={"obstacles": (pm.Wall(tip=(0.3, 0.5)), pm.Wall(tip=(0.7, 0.5)))})
OVER_UNDER = TRUE.model_copy(
    update={
        "obstacles": (pm.Wall(tip=(0.25, 0.3)), pm.Wall(tip=(0.5, -0.3), direction=(0, 1)), pm.Wall(tip=(0.75, 0.3)))
    }
)


def test_ipopt(benchmark):
    from peer import ipopt

    peak = benchmark.pedantic(ipopt, (100, 0.3), rounds=3, warmup_rounds=1)
    benchmark.extra_info.update(group="proof", name="CasADi + IPOPT, local (peer)", value=peak)


@pytest.mark.parametrize(
    ("name", "maneuver", "gap"),
    [
        ("one wall, gap 1e-6", TRUE, 1e-6),
        ("two-link numbers, gap 1e-6", TWO_LINK, 1e-6),
        ("two walls, gap 1e-4", TWO, 1e-4),
        ("three walls, gap 1e-4", OVER_UNDER, 1e-4),
    ],
)
def test_certified(benchmark, name, maneuver, gap):
    found = benchmark(lambda: least_over_times(PointMass.of(maneuver), gap))
    unit = PointMass.of(maneuver).unit
    benchmark.extra_info.update(
        group="proof", name=name, value=found.best.upper * unit, gap=found.gap, boxes=found.nodes
    )


def test_linprog_sweep(benchmark):
    from peer import sweep

    circle = pm.Polygon(segments=5)
    nodes = np.round(obstacle_nodes() / STEP).astype(int)
    arguments = (nodes, 199, STEP, circle.normals, circle.inradius, (0.5, 0.5), (1, 0), 15.0, 0.01)
    peaks = benchmark.pedantic(sweep, arguments, rounds=1)
    benchmark.extra_info.update(group="proof", name="linprog sweep (peer)", value=min(peaks))


def test_direct_at_one_time(benchmark):
    program = pm.DirectProgram(TRUE, pm.Disc(), pm.Aligned(steps=200))
    program.place([0.4])
    program.solve("CLARABEL")
    benchmark(program.solve, "CLARABEL")
    benchmark.extra_info.update(group="one time", name="direct, 200 holds", value=program.M)


def test_exact_at_one_time(benchmark):
    mass = PointMass.of(TRUE)
    found = benchmark(extremal, mass, np.array([0.4]))
    benchmark.extra_info.update(group="one time", name="exact", value=found.upper * mass.unit, gap=found.gap)
