"""Maneuvers of least peak base reaction force, each with a proof.

    import peakmin as pm
    plan = pm.solve(pm.Maneuver(start=pm.State(position=(0, 0)), goal=pm.State(position=(1, 0)), duration=1.0))

The programs are loaded on first use: reading a spec does not wait for cvxpy.
"""

from typing import TYPE_CHECKING, Any

from .bracket import Answer, Bracket, HoldProblem, Verdict
from .circle import Disc, Polygon
from .errors import NotDPPError, PeakminError, SpecError
from .grid import Aligned, Uniform
from .plan import Check, Made, Plan
from .spec import Bisection, Direct, Maneuver, RefineSearch, Settings, Spec, State, SweepSearch, Wall, schema
from .sweep import Sweep, solve, sweep

if TYPE_CHECKING:
    from .program import DirectProgram, FeasibilityProgram

__all__ = [
    "Aligned",
    "Answer",
    "Bisection",
    "Bracket",
    "Check",
    "Direct",
    "DirectProgram",
    "Disc",
    "FeasibilityProgram",
    "HoldProblem",
    "Made",
    "Maneuver",
    "NotDPPError",
    "PeakminError",
    "Plan",
    "Polygon",
    "RefineSearch",
    "Settings",
    "Spec",
    "SpecError",
    "State",
    "Sweep",
    "SweepSearch",
    "Uniform",
    "Verdict",
    "Wall",
    "schema",
    "solve",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name in ("DirectProgram", "FeasibilityProgram"):
        from . import program

        return getattr(program, name)
    raise AttributeError(f"module 'peakmin' has no attribute {name!r}")
