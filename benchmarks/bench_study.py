"""A study of 200 maneuvers on one process and on two, started for it: by default, and by the paper's bisection."""

import os

import pytest

import peakmin as pm
from peakmin.paper import GENERAL

LINEAR = pm.Settings(circle=pm.Polygon(segments=5), grid=pm.Aligned(steps=50), method=pm.Bisection())


@pytest.mark.parametrize(("kind", "settings"), [("default", pm.Settings()), ("bisection on a 20-gon", LINEAR)])
@pytest.mark.parametrize("workers", [1, 2])
def test_study(benchmark, workers, kind, settings):
    specs = [
        pm.Spec(maneuver=GENERAL.model_copy(update={"duration": 1.0 + 0.005 * k}), settings=settings)
        for k in range(200)
    ]
    found = benchmark.pedantic(lambda: pm.study(specs, workers=workers), rounds=1 if settings is LINEAR else 3)
    name = f"{workers} of {len(os.sched_getaffinity(0))} processors"
    benchmark.extra_info.update(group=f"study of 200, {kind}", name=name, value=float(found["peak"].max()))
