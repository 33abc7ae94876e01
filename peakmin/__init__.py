"""Maneuvers of least peak base reaction force, each with a proof.

    import peakmin as pm
    plan = pm.solve(pm.Maneuver(start=pm.State(position=(0, 0)), goal=pm.State(position=(1, 0)), duration=1.0))

The programs are loaded on first use: reading a spec does not wait for cvxpy.
"""

from __future__ import annotations

from importlib.metadata import version as _version
from typing import TYPE_CHECKING, Any

from .api import solve, verify
from .errors import NotDPPError, PeakminError, SpecError
from .geometry.frame import Frame
from .plan.plan import Made, Plan
from .plan.verify import Verification
from .proofs.bounds import Leaf, Proof
from .proofs.bracket import Answer, Bracket, HoldProblem, Verdict
from .proofs.check import Check
from .proofs.sensitivity import Sensitivities
from .queries.budget import ErrorBudget, error_budget
from .queries.shortest import Shortest, shortest
from .queries.study.study import study
from .queries.study.table import Study
from .search.sweep import Sweep, sweep
from .spec.control_set import Disc, Polygon
from .spec.maneuver import Maneuver, State
from .spec.obstacles import Block, Wall
from .spec.settings import Aligned, Bisection, Direct, Exact, GlobalSearch, RefineSearch, Settings, SweepSearch, Uniform
from .spec.spec import Spec, schema
from .spec.study import StudySpec

if TYPE_CHECKING:
    from .plan.arm_plan import ArmPlan
    from .programs.program import DirectProgram, FeasibilityProgram
    from .queries.explain import explain
    from .queries.oracle import PeakOracle, Peaks
    from .spec.arm import Arm, ArmManeuver, Link, Pose
    from .spec.spec import ArmSpec

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
    "programs.program": ("DirectProgram", "FeasibilityProgram"),
    "spec.arm": ("Arm", "ArmManeuver", "Link", "Pose"),
    "spec.spec": ("ArmSpec",),
    "plan.arm_plan": ("ArmPlan",),
    "queries.explain": ("explain",),
    "queries.oracle": ("PeakOracle", "Peaks"),
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    for module, names in _LATER.items():
        if name in names:
            return getattr(import_module(f".{module}", __name__), name)
    raise AttributeError(f"module 'peakmin' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *globals()} - {"Any", "TYPE_CHECKING"})
