"""What is said and drawn of one kind of task or plan only, in one table: all else in view is the same for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ..plan.arm_plan import ArmPlan
from ..plan.plan import Plan
from ..spec.task import Task
from . import sentences, sketches
from .animation import Scene, arm_scene, point_scene
from .beside import Tables, tables
from .curves import (
    base_force,
    control_size,
    joint_accelerations,
    joint_angles,
    joint_speeds,
    joint_torques,
    peak_over_contact,
)
from .paths import arm_path, path, poses

if TYPE_CHECKING:
    from .pyplot import Axes

P = TypeVar("P", Plan, ArmPlan)


@dataclass(frozen=True)
class Kind(Generic[P]):
    """Functions of a task or a plan of this kind.

    problem: the picture of a task;  units: numbers of it that may be meant in others.
    bounded: of what its lower bound is one;  made: how it was made;  facts: lines under its answer;
    tries: other questions that may help;  finer: settings that may;  holds: what a control has too few of.
    beside: the report's tables of what it does at most.
    place: the picture that needs no motion;  panels: those beside it in the overview;  alone: those by themselves, by
    the names of their files;  scene: what moves in its animation.
    film: the animation's file;  filmed: whether the terminal makes it unless told otherwise.
    """

    problem: Callable[[Any, Axes | None], Axes]
    units: Callable[[Any], list[str]]
    bounded: Callable[[P], str]
    made: Callable[[P], str]
    facts: Callable[[P], list[str]]
    tries: Callable[[P], list[str]]
    finer: Callable[[P], list[str]]
    holds: Callable[[P], list[str]]
    beside: Callable[[P], Tables]
    place: Callable[[P, Axes], Axes]
    panels: tuple[Callable[[P, Axes], Axes], ...]
    alone: Callable[[P], dict[str, Callable[[P, Axes], Axes]]]
    scene: Callable[[P, int, Axes, Axes], Scene]
    film: str
    filmed: bool


def _alone(plan: ArmPlan) -> dict[str, Callable[[ArmPlan, Axes], Axes]]:
    joints = (joint_angles, joint_speeds, joint_accelerations, joint_torques)
    drawn = {"poses": poses, **{draw.__name__: draw for draw in joints}, "path": arm_path, "base_force": base_force}
    one = len(plan.crossing.walls) == 1 and not plan.elbow_changes
    return {**drawn, **({"peak_over_time": peak_over_contact} if one else {})}


AnyKind = Kind[Any]  # no type says that a plan's key finds the functions for its type

KINDS: dict[str, AnyKind] = {  # of tasks and plans that are of the key's kind
    "point": Kind[Plan](
        problem=sketches.problem,
        units=sentences.point_units,
        bounded=sentences.point_bounded,
        made=sentences.point_made,
        facts=sentences.point_facts,
        tries=sentences.point_tries,
        finer=sentences.finer,
        holds=sentences.point_holds,
        beside=lambda plan: Tables([], []),
        place=path,
        panels=(control_size,),
        alone=lambda plan: {},
        scene=point_scene,
        film="plan.gif",
        filmed=False,
    ),
    "arm": Kind[ArmPlan](
        problem=sketches.arm_problem,
        units=sentences.arm_units,
        bounded=sentences.arm_bounded,
        made=sentences.arm_made,
        facts=sentences.arm_facts,
        tries=sentences.arm_tries,
        finer=sentences.arm_finer,
        holds=lambda plan: [],
        beside=tables,
        place=poses,
        panels=(arm_path, joint_angles, control_size),
        alone=_alone,
        scene=arm_scene,
        film="arm.gif",
        filmed=True,
    ),
}


def kind_of(one: Task | Plan) -> AnyKind:
    """What is said and drawn of tasks and plans of this one's kind."""
    return KINDS[one.kind]
