"""Maneuvers of least peak base reaction force, each with a proof.

    import peakmin as pm
    plan = pm.solve(pm.Maneuver(start=pm.State(position=(0, 0)), goal=pm.State(position=(1, 0)), duration=1.0))

The programs are loaded on first use: reading a spec does not wait for cvxpy.
"""

from importlib.metadata import version as _version
from typing import TYPE_CHECKING, Any

from .api import explain, solve, verify
from .bracket import Answer, Bracket, HoldProblem, Verdict
from .budget import ErrorBudget, error_budget
from .certify import Leaf, Proof
from .check import Check
from .circle import Disc, Polygon
from .errors import NotDPPError, PeakminError, SpecError
from .frame import Frame
from .grid import Aligned, Uniform
from .obstacles import Block, Wall
from .plan import Made, Plan
from .sensitivity import Sensitivities
from .shortest import Shortest, shortest
from .spec import (
    Bisection,
    Direct,
    Exact,
    GlobalSearch,
    Maneuver,
    RefineSearch,
    Settings,
    Spec,
    State,
    SweepSearch,
    schema,
)
from .study import study
from .sweep import Sweep, sweep
from .table import Study
from .variation import StudySpec
from .verify import Verification

if TYPE_CHECKING:
    from .arm.maneuver import ArmManeuver, ArmSpec
    from .arm.plan import ArmPlan
    from .arm.spec import Arm, Link, Pose
    from .oracle import PeakOracle, Peaks
    from .program import DirectProgram, FeasibilityProgram

__version__ = _version("peakmin")

__all__ = [
    "Aligned",
    "Answer",
    "Arm",
    "ArmManeuver",
    "ArmPlan",
    "ArmSpec",
    "Bisection",
    "Block",
    "Bracket",
    "Check",
    "Direct",
    "DirectProgram",
    "Disc",
    "ErrorBudget",
    "Exact",
    "FeasibilityProgram",
    "Frame",
    "GlobalSearch",
    "HoldProblem",
    "Leaf",
    "Link",
    "Made",
    "Maneuver",
    "NotDPPError",
    "PeakOracle",
    "PeakminError",
    "Peaks",
    "Plan",
    "Polygon",
    "Pose",
    "Proof",
    "RefineSearch",
    "Sensitivities",
    "Settings",
    "Shortest",
    "Spec",
    "SpecError",
    "State",
    "Study",
    "StudySpec",
    "Sweep",
    "SweepSearch",
    "Uniform",
    "Verdict",
    "Verification",
    "Wall",
    "error_budget",
    "explain",
    "schema",
    "shortest",
    "solve",
    "study",
    "sweep",
    "verify",
]


_LATER = {  # what takes time to import, by its module
    "program": ("DirectProgram", "FeasibilityProgram"),
    "arm.spec": ("Arm", "Link", "Pose"),
    "arm.maneuver": ("ArmManeuver", "ArmSpec"),
    "arm.plan": ("ArmPlan",),
    "oracle": ("PeakOracle", "Peaks"),
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    for module, names in _LATER.items():
        if name in names:
            return getattr(import_module(f".{module}", __name__), name)
    raise AttributeError(f"module 'peakmin' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *globals()} - {"Any", "TYPE_CHECKING"})
