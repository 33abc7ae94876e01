"""A plan as a JSON document and back. A document is data: it states; `peakmin.verify` finds out."""

from __future__ import annotations

import hashlib
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays import Array
from .certify import Leaf, Proof
from .costate import CostateTrajectory
from .errors import SpecError
from .model import load
from .moments import PointMass
from .spec import Spec
from .trajectory import HoldTrajectory, Trajectory

if TYPE_CHECKING:
    from .plan import Plan

COSTATE_ARRAYS = ("first", "last", "size", "first_error", "last_error")
SAMPLES = 200  # panels of the samples that a costate plan lists beside its closed form


def of(plan: Plan) -> dict[str, Any]:
    """The document of a plan; numbers that are not known are null."""
    motion = plan.trajectory
    t = listed_times(plan.trajectory, plan.maneuver.duration)
    acceleration = t[:-1] if isinstance(motion, HoldTrajectory) else t
    data: dict[str, Any] = {
        "version": 1,
        "status": plan.status,
        "peak": plan.peak if math.isfinite(plan.peak) else None,
        "lower_bound": plan.lower_bound,
        "gap": plan.gap,
        "scope": plan.scope,
        "peak_force": plan.peak_force if math.isfinite(plan.peak) else None,
        "obstacle_times": plan.obstacle_times.tolist(),
        "times": t.tolist(),
        "position": motion.position(t).tolist() if motion else [],
        "velocity": motion.velocity(t).tolist() if motion else [],
        "acceleration": motion.acceleration(acceleration).tolist() if motion else [],
        "multipliers": plan.multipliers.tolist(),
        "sensitivities": {name: np.asarray(value).tolist() for name, value in vars(plan.sensitivities).items()},
        "proof": [
            {name: np.asarray(value).tolist() for name, value in vars(leaf).items()} for leaf in plan.proof.leaves
        ],
        "spec": json.loads(Spec(maneuver=plan.maneuver, settings=plan.settings).to_json()),
    }
    if isinstance(motion, CostateTrajectory):
        data["costate"] = {"nodes": motion.nodes.tolist()}
        data["costate"] |= {name: getattr(motion, name).tolist() for name in COSTATE_ARRAYS}
    data["digest"] = digest(data)
    data["made"] = dict(vars(plan.made))
    return data


def digest(data: dict[str, Any]) -> str:
    """SHA-256 of everything but the digest and how the plan was made."""
    kept = {key: value for key, value in data.items() if key not in ("digest", "made")}
    return hashlib.sha256(json.dumps(kept, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def listed_times(motion: Trajectory | None, duration: float) -> Array:
    """Times [s] at which a document lists states: a hold motion's nodes, or its nodes and even samples."""
    if motion is None:
        return np.zeros(0)
    if isinstance(motion, HoldTrajectory):
        return motion.nodes
    return np.union1d(motion.nodes, duration * np.arange(SAMPLES + 1) / SAMPLES)


def read(text: str | bytes) -> Plan:
    """The plan that a document states. Raises `SpecError` in one line when it is not one."""
    data = load(text, finite=True)
    try:
        return _plan(data)
    except SpecError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise SpecError(f"the document: was not a plan ({type(error).__name__}: {error}), must be one") from None


def _plan(data: dict[str, Any]) -> Plan:
    from .plan import Made, Plan

    if data.get("version") != 1:
        raise SpecError(f"version: was {data.get('version')!r}, must be 1")
    spec = Spec(**data["spec"])
    mass = PointMass.of(spec.maneuver)
    shape = (2 + mass.walls, 2)
    leaves = tuple(
        Leaf(
            _times(leaf["low"], mass),
            _times(leaf["high"], mass),
            _array(leaf["multipliers"], shape),
            _times(leaf["at"], mass),
        )
        for leaf in data["proof"]
    )
    if data["scope"] not in ("all", "these") or data["status"] not in ("solved", "infeasible", "unknown"):
        raise ValueError("unknown scope or status")
    return Plan(
        spec.maneuver,
        spec.settings,
        data["status"],
        _motion(data, spec),
        _array(data["obstacle_times"], (mass.walls,)),
        math.inf if data["peak"] is None else _number(data["peak"]),
        _number(data["lower_bound"]),
        Proof(data["scope"], leaves),
        _array(data["multipliers"], shape),
        Made(**data["made"]),
    )


def _motion(data: dict[str, Any], spec: Spec) -> Trajectory | None:
    start = np.array(spec.maneuver.start.position), np.array(spec.maneuver.start.velocity)
    if not data["times"]:
        return None
    if "costate" in data:
        nodes = _array(data["costate"]["nodes"])
        k = len(nodes) - 1
        shapes = {"size": (k,)}
        arrays = {name: _array(data["costate"][name], shapes.get(name, (k, 2))) for name in COSTATE_ARRAYS}
        if np.any(arrays["size"] < 0):
            raise ValueError("a size is below zero")
        return CostateTrajectory(nodes, **arrays, start_position=start[0], start_velocity=start[1])
    nodes = _array(data["times"])
    return HoldTrajectory(nodes, _array(data["acceleration"], (len(nodes) - 1, 2)), *start)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise ValueError(f"{value!r} is not a finite number from zero up")
    return float(value)


def _array(value: Any, shape: tuple[int, ...] | None = None) -> Array:
    array = np.array(value, dtype=float)
    if shape is not None:
        array = array.reshape(shape)
    if not np.all(np.isfinite(array)):
        raise ValueError("a number is not finite")
    return array


def _times(value: Any, mass: PointMass) -> tuple[float, ...]:
    times = _array(value, (mass.walls,))
    if np.any(times < 0) or np.any(times > 1):
        raise ValueError("a box of the proof reaches out of the duration")
    return tuple(times.tolist())
