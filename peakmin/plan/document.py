"""A plan as a JSON document and back. A document is data: it states; `peakmin.verify` finds out."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..errors import SpecError
from ..geometry.costate import CostateTrajectory
from ..geometry.trajectory import HoldTrajectory, Trajectory
from ..proofs.bounds import Leaf, Proof
from ..proofs.double_integrator import PointMass
from ..scenes.blocks import Branch, Cells, WaysProof
from ..spec.maneuver import Maneuver
from ..spec.model import LARGEST
from ..spec.obstacles import Wall
from ..spec.reading import load, short
from ..spec.spec import Spec
from ..types import Array

if TYPE_CHECKING:
    from .plan import Plan

P = TypeVar("P")
VERSION = 1  # of plan documents
COSTATE_ARRAYS = ("first", "last", "size", "first_error", "last_error")
SAMPLES = 200  # panels of the samples that a costate plan lists beside its closed form


def of(plan: Plan) -> dict[str, Any]:
    """The document of a plan; numbers that are not known are null."""
    motion = plan.trajectory
    t = listed_times(plan.trajectory, plan.maneuver.duration)
    acceleration = t[:-1] if isinstance(motion, HoldTrajectory) else t
    data: dict[str, Any] = {
        "version": VERSION,
        "status": plan.status,
        "peak": plan.peak if math.isfinite(plan.peak) else None,
        "lower_bound": plan.lower_bound,
        "gap": plan.gap,
        "scope": plan.scope,
        "peak_force": plan.peak_force if math.isfinite(plan.peak) else None,
        "obstacle_times": plan.obstacle_times.tolist(),
        "clearance": plan.clearance if math.isfinite(plan.clearance) else None,
        "times": t.tolist(),
        "position": motion.position(t).tolist() if motion else [],
        "velocity": motion.velocity(t).tolist() if motion else [],
        "acceleration": motion.acceleration(acceleration).tolist() if motion else [],
        "multipliers": plan.multipliers.tolist(),
        "sensitivities": {name: _known(value) for name, value in vars(plan.sensitivities).items()},
        "proof": _proof(plan.proof),
        "spec": json.loads(Spec(maneuver=plan.maneuver, settings=plan.settings).to_json()),
    }
    if plan.maneuver.blocks:
        data["walls"] = [json.loads(wall.to_json()) for wall in plan.walls]
    if isinstance(motion, CostateTrajectory):
        data["costate"] = {"nodes": motion.nodes.tolist()}
        data["costate"] |= {name: getattr(motion, name).tolist() for name in COSTATE_ARRAYS}
    data["digest"] = digest(data)
    data["made"] = dict(vars(plan.made))
    return data


def _known(value: Array | float) -> Any:
    """Numbers as lists, those that are none as null."""
    return np.where(np.isnan(value), None, value).tolist()  # type: ignore[call-overload]


def _proof(proof: Proof | WaysProof) -> list[dict[str, Any]]:
    if isinstance(proof, WaysProof):
        return [
            {
                "way": [list(gaps) for gaps in branch.way],
                "lines": [list(line) for line in branch.lines],
                "leaves": listed_leaves(branch.leaves),
            }
            for branch in proof.branches
        ]
    return listed_leaves(proof.leaves)


def listed_leaves(leaves: tuple[Leaf, ...]) -> list[dict[str, Any]]:
    return [{name: np.asarray(value).tolist() for name, value in vars(leaf).items()} for leaf in leaves]


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
    return read_by(_plan, load(text, finite=True))


def read_by(made: Callable[[dict[str, Any]], P], data: dict[str, Any]) -> P:
    """What `made` makes of a document's data. Raises `SpecError` in one line where it can make nothing of them."""
    try:
        with np.errstate(all="ignore"):  # a number that is none fails every comparison that it enters
            return made(data)
    except SpecError:
        raise
    except KeyError as error:
        raise SpecError(f"the document: was not a plan, {short(error.args[0])} is missing") from None
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RecursionError) as error:
        raise SpecError(f"the document: was not a plan ({type(error).__name__}: {short(str(error), 120)})") from None


def _plan(data: dict[str, Any]) -> Plan:
    from .plan import Made, Plan

    known_plan(data)
    spec = Spec(**data["spec"])
    walls = tuple(Wall(**wall) for wall in data["walls"]) if spec.maneuver.blocks else spec.maneuver.walls
    mass = PointMass.of(spec.maneuver.past(walls))
    if data["scope"] not in ("all", "these") or data["status"] not in ("solved", "infeasible", "unknown"):
        raise ValueError("unknown scope or status")
    proof: Proof | WaysProof
    if spec.maneuver.blocks:
        if data["scope"] != "all":
            raise ValueError("the proof past blocks is of all times")
        cells = Cells.of(spec.maneuver)
        proof = WaysProof(tuple(_branch(branch, cells) for branch in data["proof"]))
    else:
        proof = Proof(data["scope"], leaves_of(data["proof"], mass.walls))
    return Plan(
        spec.maneuver,
        spec.settings,
        data["status"],
        motion_of(data, spec.maneuver),
        walls,
        array(data["obstacle_times"], (mass.walls,)),
        math.inf if data["clearance"] is None else float(array(data["clearance"], ())),
        math.inf if data["peak"] is None else number(data["peak"]),
        number(data["lower_bound"]),
        proof,
        array(data["multipliers"], (2 + mass.walls, 2)),
        Made(**data["made"]),
    )


def known_plan(data: dict[str, Any]) -> None:
    """Refuse a document of another version, or none. Raises `SpecError`."""
    version = data.get("version")
    if type(version) is not int or version != VERSION:
        raise SpecError(f"version: was {short(version)}, must be {VERSION} (the only version so far)")


def _branch(data: dict[str, Any], cells: Cells) -> Branch:
    way = tuple(tuple(gaps) for gaps in data["way"])
    if len(way) != len(cells.gaps) or any(
        isinstance(g, bool) or not isinstance(g, int) or not 0 <= g < len(there)
        for gaps, there in zip(way, cells.gaps, strict=True)
        for g in gaps
    ):
        raise ValueError("a way of the proof is not through these blocks")
    lines = tuple((float(array(x, ())), k) for x, k in data["lines"])
    if any(isinstance(k, bool) or not isinstance(k, int) or not cells.has((x, k)) for x, k in lines):
        raise ValueError("a line of the proof is not between start and goal")
    kept = cells.through(way)
    return Branch(way, lines, leaves_of(data["leaves"], 0 if kept is None else len(cells.marks(kept, lines))))


def leaves_of(data: Any, walls: int) -> tuple[Leaf, ...]:
    return tuple(
        Leaf(
            _times(leaf["low"], walls),
            _times(leaf["high"], walls),
            array(leaf["multipliers"], (2 + walls, 2)),
            _times(leaf["at"], walls),
        )
        for leaf in data
    )


def motion_of(data: dict[str, Any], maneuver: Maneuver) -> Trajectory | None:
    """The motion that a document lists, from the maneuver's start."""
    start = np.array(maneuver.start.position), np.array(maneuver.start.velocity)
    if not data["times"]:
        return None
    if "costate" in data:
        nodes = array(data["costate"]["nodes"])
        k = len(nodes) - 1
        shapes = {"size": (k,)}
        arrays = {name: array(data["costate"][name], shapes.get(name, (k, 2))) for name in COSTATE_ARRAYS}
        if np.any(arrays["size"] < 0):
            raise ValueError("a size is below zero")
        return CostateTrajectory(nodes, **arrays, start_position=start[0], start_velocity=start[1])
    nodes = array(data["times"])
    return HoldTrajectory(nodes, array(data["acceleration"], (len(nodes) - 1, 2)), *start)


def number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise ValueError(f"{short(value)} is not a finite number from zero up")
    return float(value)


def array(value: Any, shape: tuple[int, ...] | None = None) -> Array:
    array = np.array(value, dtype=float)
    if shape is not None:
        array = array.reshape(shape)
    if not np.all(np.abs(array) <= LARGEST):
        raise ValueError(f"a number is above {LARGEST:g} in size, or none")
    return array


def _times(value: Any, walls: int) -> tuple[float, ...]:
    times = array(value, (walls,))
    if np.any(times < 0) or np.any(times > 1):
        raise ValueError("a box of the proof reaches out of the duration")
    return tuple(times.tolist())
