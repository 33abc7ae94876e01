"""A spec's row: what a study says of one problem."""

from __future__ import annotations

import hashlib
import json
import math
import threading
import time
from typing import TYPE_CHECKING, Any

from .api import solve, spec_of
from .errors import PeakminError
from .model import load
from .spec import Spec

if TYPE_CHECKING:
    from .arm.maneuver import ArmSpec

_one_at_a_time = threading.Lock()  # cvxpy does not build problems in two threads at once


def spec_hash(spec: Spec | ArmSpec) -> str:
    """16 hexadecimal digits of the SHA-256 of a spec: of all its fields, defaults included, in any order."""
    text = json.dumps(json.loads(spec.to_json()), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def solved_row(text: str) -> dict[str, Any]:
    """What a row has to say of a spec (JSON text), in plain values; numbers that are not known are None.

    An exception makes a row, too: of status "failed", with what it said as `error`.
    """
    from .compiled import shared

    began = time.perf_counter()
    try:
        asked = spec_of(load(text))
        with _one_at_a_time, shared():
            plan = solve(asked.maneuver if isinstance(asked, Spec) else asked.asked, asked.settings)
    except Exception as error:
        said = str(error) if isinstance(error, PeakminError) else f"{type(error).__name__}: {error}"
        return failed(said, time.perf_counter() - began)
    return {
        "status": plan.status,
        "peak": _known(plan.peak),
        "lower_bound": _known(plan.lower_bound),
        "gap": _known(plan.gap),
        "scope": plan.scope,
        "peak_force": _known(plan.peak_force),
        "obstacle_times": plan.obstacle_times.tolist(),
        "clearance": _known(plan.clearance),
        "solver": plan.made.solver,
        "compilations": plan.made.compilations,
        "seconds": time.perf_counter() - began,
        "error": None,
    }


def failed(error: str, seconds: float | None = None) -> dict[str, Any]:
    """The row of a spec without an answer."""
    return {**FAILED, "seconds": seconds, "error": " ".join(error.split())}


FAILED: dict[str, Any] = {
    "status": "failed",
    **dict.fromkeys(("peak", "lower_bound", "gap", "scope", "peak_force", "obstacle_times", "clearance", "solver")),
    "compilations": 0,
    "seconds": None,
    "error": None,
}


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
