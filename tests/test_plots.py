"""Every figure draws on the axes it is given and names its units."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import peakmin as pm
from peakmin import plots

from .conftest import wall_maneuver


@pytest.fixture(params=["direct", "exact"])
def plan(request):
    yield pm.solve(wall_maneuver(), pm.Settings(method={"kind": request.param}, search={"kind": "global", "gap": 1e-3}))
    plt.close("all")


@pytest.mark.parametrize("draw", [plots.path, plots.control, plots.control_size])
def test_plans(plan, draw):
    ax = plt.figure().add_subplot()
    assert draw(plan, ax=ax) is ax
    assert "[" in ax.get_xlabel()
    assert "[" in ax.get_ylabel()


def test_a_continuous_control_is_drawn_as_a_curve_that_reaches_the_peak():
    plan = pm.solve(wall_maneuver(), pm.Settings(method=pm.Exact(), search={"kind": "global", "gap": 1e-3}))
    line = plots.control(plan, axis=1).get_lines()[0]
    assert len(line.get_xdata()) > 500
    assert np.max(np.abs(line.get_ydata())) == pytest.approx(plan.peak, rel=1e-3)
    plt.close("all")


def test_overview_and_budget(plan):
    assert len(plots.overview(plan).axes) == 2
    errors = pm.error_budget(plan.maneuver, plan.settings, plan=plan)
    ax = errors.plot()
    assert len(ax.patches) == 5
    widths = sum(patch.get_width() for patch in ax.patches)
    assert widths == pytest.approx(errors.total, abs=1e-12)


def test_sweeps_over_one_wall_only(plan):
    pm.sweep(plan.maneuver, times=[0.4, 0.5]).plot()
    with pytest.raises(ValueError, match="one wall"):
        pm.sweep(wall_maneuver(obstacles=())).plot()
