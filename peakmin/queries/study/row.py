"""What a study says of one spec."""

from __future__ import annotations

import hashlib
import json
import math
import threading
import time
from typing import Literal, TypedDict

from ...errors import PeakminError
from ...plan.document import Status
from ...plan.reason import reason
from ...search.solve import solve
from ...spec.reading import load
from ...spec.spec import AnySpec, spec_of
from ..threads import OfThread

_one_at_a_time = threading.Lock()  # cvxpy does not build problems in two threads at once
_own = OfThread()  # of a worker; executors carry functions with their text only, so what stays has to stand here


class Row(TypedDict):
    """An answer in plain values, None where not known.

    reason: why it is infeasible or unknown;  error: of the exception that ended one that is "failed".
    """

    status: Literal[Status, "failed"]
    peak: float | None  # [m/s^2]
    lower_bound: float | None  # [m/s^2]
    gap: float | None
    scope: Literal["all", "these"] | None
    peak_force: float | None  # [N]
    obstacle_times: list[float] | None  # [s]
    clearance: float | None  # [m]
    solver: str | None
    compilations: int
    seconds: float | None
    reason: str | None
    error: str | None


def spec_hash(spec: AnySpec) -> str:
    """16 hexadecimal digits of the SHA-256 of a spec: of all its fields, defaults included, in any order."""
    text = json.dumps(json.loads(spec.to_json()), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def solved_row(text: str) -> Row:
    """The row of a spec (JSON text). An exception makes a row, too."""
    began = time.perf_counter()
    try:
        asked = spec_of(load(text))
        with _one_at_a_time, _own.programs as programs:
            plan = solve(asked.task, asked.settings, programs=programs)
    except Exception as error:
        said = str(error) if isinstance(error, PeakminError) else f"{type(error).__name__}: {error}"
        return failed(said, time.perf_counter() - began)
    return Row(
        status=plan.status,
        peak=_known(plan.peak),
        lower_bound=_known(plan.lower_bound),
        gap=_known(plan.gap),
        scope=plan.scope,
        peak_force=_known(plan.peak_force),
        obstacle_times=plan.obstacle_times.tolist(),
        clearance=_known(plan.clearance),
        solver=plan.made.solver,
        compilations=plan.made.compilations,
        seconds=time.perf_counter() - began,
        reason=reason(plan),
        error=None,
    )


def failed(error: str, seconds: float | None = None) -> Row:
    """The row of a spec without an answer, after so many seconds."""
    return Row(
        status="failed",
        peak=None,
        lower_bound=None,
        gap=None,
        scope=None,
        peak_force=None,
        obstacle_times=None,
        clearance=None,
        solver=None,
        compilations=0,
        seconds=seconds,
        reason=None,
        error=" ".join(error.split()),
    )


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
