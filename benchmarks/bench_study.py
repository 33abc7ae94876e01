"""A study of 200 maneuvers on one process and on two."""

import os

import pytest

import peakmin as pm
from peakmin.paper import GENERAL

SPECS = [
    pm.Spec(maneuver=GENERAL.model_copy(update={"duration": 1.0 + 0.005 * k}), settings=pm.Settings())
    for k in range(200)
]


@pytest.mark.parametrize("workers", [1, 2])
def test_study(benchmark, workers):
    found = benchmark.pedantic(lambda: pm.study(SPECS, workers=workers), rounds=1)
    name = f"{workers} of {len(os.sched_getaffinity(0))} processors"
    benchmark.extra_info.update(group="study of 200", name=name, value=float(found["peak"].max()))
