"""The cost of a query: an oracle's against solving anew, past one wall and with programs on holds."""

import numpy as np
import pytest

import peakmin as pm
from peakmin.paper import GENERAL

TRUE = GENERAL.model_copy(update={"duration": 1.0})
TIPS = np.random.default_rng(0).uniform([0.3, 0.2], [0.7, 0.6], (50, 1, 2))
HELD = pm.Settings(circle=pm.Polygon(segments=5), method=pm.Direct())


@pytest.mark.parametrize(("name", "settings"), [("exact", None), ("20-gon on 200 holds", HELD)])
def test_queries(benchmark, name, settings):
    oracle = pm.PeakOracle(TRUE, settings)
    found = benchmark.pedantic(lambda: oracle.peaks(tips=TIPS), rounds=2, warmup_rounds=1)
    assert np.all(found.solved)
    benchmark.extra_info.update(group="oracle", name=f"50 queries of an oracle, {name}", value=float(found.peak.max()))


@pytest.mark.parametrize(
    ("name", "settings"), [("exact", pm.Settings(method=pm.Exact())), ("20-gon on 200 holds", HELD)]
)
def test_solves(benchmark, name, settings):
    def each():
        return [
            pm.solve(
                TRUE.model_copy(update={"obstacles": (TRUE.walls[0].model_copy(update={"tip": tuple(tip)}),)}), settings
            )
            for (tip,) in TIPS.tolist()
        ]

    found = benchmark.pedantic(each, rounds=2, warmup_rounds=1)
    benchmark.extra_info.update(group="oracle", name=f"50 solves, {name}", value=max(plan.peak for plan in found))
