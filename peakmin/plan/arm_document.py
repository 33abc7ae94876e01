"""An arm's plan as plain JSON data and back."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from ..geometry.costate import CostateTrajectory
from ..robots.joint_space import FLOODS
from ..robots.joints import JointPath
from ..robots.link_clearance import link_clearance
from ..scenes.arm_proof import ArmProof, Branch, PassageProof, Touching, looked_at, split
from ..scenes.passages import Line, Order, Passage, passages
from ..spec.arm import ArmTask
from ..spec.obstacles import Wall
from ..spec.spec import ArmSpec
from .arm_plan import ArmPlan
from .document import (
    COSTATE_ARRAYS,
    VERSION,
    array,
    digest,
    known_plan,
    leaves_of,
    listed_leaves,
    listed_times,
    motion_of,
    number,
    read_by,
)
from .plan import Made

MOST_DEEP = 200  # splits of a tree of gaps one below another


def of(plan: ArmPlan) -> dict[str, Any]:
    """The plan as plain data: numbers, lists, words."""
    motion, path = plan.trajectory, plan.joints
    t = listed_times(motion, plan.maneuver.duration)
    spec = ArmSpec(
        arm=plan.maneuver.arm,
        maneuver=ArmTask(**{name: getattr(plan.maneuver, name) for name in ArmTask.model_fields}),
        settings=plan.settings,
    )
    data: dict[str, Any] = {
        "version": VERSION,
        "kind": "arm",
        "status": plan.status,
        "indices": list(plan.indices),
        "peak": plan.peak if math.isfinite(plan.peak) else None,
        "lower_bound": plan.lower_bound if math.isfinite(plan.lower_bound) else None,
        "gap": plan.gap,
        "scope": plan.scope,
        "peak_force": plan.peak_force if math.isfinite(plan.peak) else None,
        "obstacle_times": plan.obstacle_times.tolist(),
        "clearance": plan.clearance if math.isfinite(plan.clearance) else None,
        "contacts": [str(contact) for contact in plan.contacts],
        "exceeded": plan.exceeded,
        "times": t.tolist(),
        "position": motion.position(t).tolist() if motion else [],
        "velocity": motion.velocity(t).tolist() if motion else [],
        "acceleration": motion.acceleration(t[:-1]).tolist() if motion else [],
        "joints": plan.angles(t).tolist() if motion else [],
        "walls": [json.loads(wall.to_json()) for wall in plan.crossing.walls],
        "proof": [_passage(one) for one in plan.proof.passages],
        "flooded": plan.proof.cells,
        "spec": json.loads(spec.to_json()),
    }
    if isinstance(motion, CostateTrajectory):
        data["costate"] = {"nodes": motion.nodes.tolist()}
        data["costate"] |= {name: getattr(motion, name).tolist() for name in COSTATE_ARRAYS}
    if path is not None:
        data["path"] = {
            "pair": list(path.pair),
            "elbow": path.elbow,
            "changes": list(path.changes),
            "others": None if path.others is None else [path.others.x.tolist(), path.others(path.others.x).tolist()],
        }
    data["digest"] = digest(data)
    data["made"] = dict(vars(plan.made))
    return data


def _passage(proof: PassageProof) -> dict[str, Any]:
    return {
        "indices": list(proof.indices),
        "kept": None if proof.kept is None else _branch(proof.kept),
        "whole": None if proof.whole is None else _branch(proof.whole),
        "touching": [
            {"edge": one.edge, "arc": list(one.arc), "leaves": [listed_leaves(own) for own in one.leaves]}
            for one in proof.touching
        ],
    }


def _branch(branch: Branch) -> dict[str, Any]:
    return {
        "leaves": listed_leaves(branch.leaves),
        "line": None if branch.line is None else [branch.line.angle, branch.line.offset],
        "ends": list(branch.ends),
        "dropped": list(branch.dropped),
        "children": [None if child is None else _branch(child) for child in branch.children],
    }


def read(data: dict[str, Any]) -> ArmPlan:
    """The plan that a document states, as it states itself. Raises `SpecError` in one line when it is not one."""
    return read_by(_plan, data)


def _plan(data: dict[str, Any]) -> ArmPlan:
    known_plan(data)
    spec = ArmSpec(**data["spec"])
    workspace = spec.task.workspace
    if data["status"] not in ("solved", "infeasible", "unknown"):
        raise ValueError("unknown status")
    known = {passage.indices: passage for passage in passages(spec.task, workspace)}
    cells = data["flooded"]
    if type(cells) is not int or cells not in (0, *FLOODS) or (cells and workspace.chain.links > 2):
        raise ValueError("cells of a flood are not as many as one has")
    proof = ArmProof(tuple(_passage_of(one, known) for one in data["proof"]), cells)
    walls = tuple(Wall(**wall) for wall in data["walls"])
    motion, path, clear = None, None, None
    chosen = known[tuple(data["indices"])]
    if "path" in data:
        made = data["path"]
        motion = motion_of(data, chosen.maneuver)
        if motion is None:
            raise ValueError("joints without a motion")
        links, pair = workspace.chain.links, tuple(made["pair"])
        if len(pair) != 2 or not all(type(k) is int and 0 <= k < links for k in pair) or pair[0] >= pair[1]:
            raise ValueError("a pair of links is none")
        others = None
        if links > 2:
            knots, values = array(made["others"][0]), array(made["others"][1])
            if knots[0] != 0 or knots[-1] != spec.maneuver.duration or np.any(np.diff(knots) <= 0):
                raise ValueError("knots do not go from the start to the end")
            others = CubicSpline(knots, values.reshape(len(knots), links - 2), bc_type="clamped")
        if made["elbow"] not in (-1.0, 1.0):
            raise ValueError("an elbow is neither -1 nor 1")
        changes = tuple(array(made["changes"]).ravel().tolist())
        if np.any(np.diff([0.0, *changes, spec.maneuver.duration]) <= 0):
            raise ValueError("changes of elbow are not in order between start and end")
        path = JointPath(workspace.chain, motion, pair, float(made["elbow"]), changes, others, chosen.theta[0])
        clear = link_clearance(workspace, path)
    return ArmPlan(
        spec.task,
        spec.settings,
        data["status"],
        chosen.indices,
        chosen.maneuver.past(walls),
        array(data["obstacle_times"], (len(walls),)),
        path,
        clear,
        math.inf if data["peak"] is None else number(data["peak"]),
        math.inf if data["lower_bound"] is None else number(data["lower_bound"]),
        proof,
        Made(**data["made"]),
    )


def _passage_of(data: dict[str, Any], known: dict[tuple[int, int], Passage]) -> PassageProof:
    indices = tuple(data["indices"])
    if indices not in known:
        raise ValueError("a proof is of configurations that are none")
    passage = known[indices]
    if passage.workspace.chain.links > 2:
        return PassageProof(indices, None, (), Branch(leaves_of(data["whole"]["leaves"], 0)))
    touching = []
    for one in data["touching"]:
        if one["edge"] not in ("outer", "inner"):
            raise ValueError("an edge is neither outer nor inner")
        touched = Touching(one["edge"], tuple(array(one["arc"], (2,)).tolist()), ())
        if len(one["leaves"]) != len(touched.paths):
            raise ValueError("an arc's leaves are missing")
        leaves = tuple(
            leaves_of(own, len(past.walls) if (past := passage.past(paths)) else 0)
            for own, paths in zip(one["leaves"], touched.paths, strict=True)
        )
        touching.append(Touching(touched.edge, touched.arc, leaves))
    trunks = [
        None if data[name] is None else _branch_of(data[name], seen, (), 0)
        for name, seen in (("kept", passage), ("whole", passage.whole))
    ]
    return PassageProof(indices, trunks[0], tuple(touching), trunks[1])


def _branch_of(data: dict[str, Any], passage: Passage, order: Order, depth: int) -> Branch:
    past = passage.past(order)
    if depth > MOST_DEEP:
        raise ValueError("a tree is too deep")
    leaves = leaves_of(data["leaves"], 0 if past is None else len(past.walls))
    ends, dropped = _ends(data)
    if data["line"] is None:
        return Branch(leaves, None, (), ends, dropped)
    line = Line(*array(data["line"], (2,)).tolist())
    if not passage.parts(line):
        raise ValueError("a line is not between start and goal")
    classes = split(passage, order, line)
    children: list[Branch | None] = []
    for (place, whole), child in zip(classes, data["children"], strict=True):
        if child is None:
            children.append(None)
            continue
        children.append(_branch_of(child, passage, looked_at(whole, place, *_ends(child)), depth + 1))
    return Branch(leaves, line, tuple(children), ends, dropped)


def _ends(data: dict[str, Any]) -> tuple[tuple[bool, bool], tuple[int, ...]]:
    low, high = data["ends"]
    dropped = tuple(data["dropped"])
    if not all(isinstance(end, bool) for end in (low, high)) or not all(type(k) is int for k in dropped):
        raise ValueError("ends or conditions are none")
    return (low, high), dropped
