"""The figures and the animation of a plan of any kind, and the picture of any task."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from ..plan.plan import Plan
from ..spec.task import Task
from .animation import frames_of, gif
from .kinds import kind_of
from .style import RED, sheet

if TYPE_CHECKING:
    from .pyplot import Axes, Figure

PANEL = (5.8, 4.7)  # inches
ALONE = (7, 5.2)


def problem(task: Task, ax: Axes | None = None) -> Axes:
    """What is asked, before anything is solved."""
    return kind_of(task).problem(task, ax)


def overview(plan: Plan) -> Figure:
    """A plan on one figure: its place, and beside it, where it has a motion, what is drawn of that."""
    kind = kind_of(plan)
    painters = [kind.place, *(kind.panels if plan.trajectory is not None else ())]
    columns = min(len(painters), 2)
    size = (PANEL[0] * columns, PANEL[1] * -(-len(painters) // columns))
    figure = sheet(*(partial(draw, plan) for draw in painters), size=size, columns=columns)
    if plan.trajectory is not None and not plan.keeps:
        missing = [one.field for one in (plan.kept.excesses if plan.kept is not None else ())]
        figure.suptitle(f"{plan.status}: does not keep {', '.join(missing) or 'max_peak'}", color=RED)
    return figure


def figures(plan: Plan) -> dict[str, Figure]:
    """The figures of a plan by name: all at once, and each by itself as the paper has them."""
    alone = kind_of(plan).alone(plan) if plan.trajectory is not None else {}
    each = {name: sheet(partial(draw, plan), size=ALONE) for name, draw in alone.items()}
    return {"plan": overview(plan), **each}


def animate(plan: Plan, frames: int | None = None) -> bytes:
    """A plan in motion, as a GIF: the centre of mass with its control arrow, or the arm with its base force.

    It lasts as long as the motion, as far as a GIF can state it, and shows the time.

    Args:
        frames: how many; by default twelve a second, within limits.

    Raises:
        ValueError: where the plan has no motion.
    """
    if plan.trajectory is None:
        raise ValueError(f"this plan is {plan.status}: it has no trajectory")
    duration = plan.maneuver.duration
    frames = frames_of(duration) if frames is None else frames
    return gif(partial(kind_of(plan).scene, plan, frames), duration, frames)
