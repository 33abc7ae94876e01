"""A held control that keeps at every instant what no finite set of equations states: solve, look, ask more.

A region, a speed, the near and far sides of walls, and what links would touch are asked for at the nodes, a little
more than needed, until the path between the nodes keeps them too. For fixed obstacle times it is one program,

    maximise kappa = 1/M  subject to  v_k in shape,  A v = kappa b,   n . r_k >= kappa c,   |V_k| <= kappa max_speed

with r and V the position and velocity at the nodes, kappa times as large. The lower bound stays that of the problem
without these conditions. A region, a speed, and "near side until the first crossing" are conditions of the problem or
of every path that crosses first at T_i; "far side from then on" is a choice, and may cost something.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from scipy.optimize import minimize

from ..deadline import OverError, over
from ..geometry.trajectory import HoldTrajectory, Trajectory
from ..plan.found import Found
from ..programs.program import Count
from ..programs.states import StateProgram
from ..proofs.bracket import Bracket
from ..proofs.double_integrator import PointMass
from ..scenes.blocks import WayClass
from ..scenes.kept import Kept, inward
from ..scenes.kinds import PointScene
from ..scenes.scene import Plane
from ..spec.frame import Frame
from ..spec.maneuver import Maneuver
from ..spec.settings import Aligned
from ..types import Array
from .job import Job

TRIES = 6  # of asking a little more
FIRST_ROOM = 1e-9  # of the scene: asked more than needed at first
MOST_TIMES = 25  # obstacle times looked at around the first ones

Asked = TypeVar("Asked")
Motion = TypeVar("Motion")


def asked_more(
    asked: Asked,
    solve: Callable[[Asked], Motion | None],
    more: Callable[[Motion, Asked], Asked | None],
    tries: int,
    until: float,
) -> Motion | None:
    """The first solution of which nothing more is to be asked; None where there is none, or the time is over.

    Args:
        asked: what is asked at first.
        more: looks at a solution: what is to be asked next, or None.
    """
    for _ in range(tries):
        if over(until) or (motion := solve(asked)) is None:
            return None
        further = more(motion, asked)
        if further is None:
            return motion
        asked = further
    return None


@dataclass(frozen=True)
class Rooms:
    """What is asked more than needed [m, m/s], and the edges of gaps that nodes keep to."""

    sides: float = 0.0
    region: float = 0.0
    speed: float = 0.0
    gaps: float = 0.0
    planes: tuple[Plane, ...] = ()


@dataclass(frozen=True)
class Held:
    """A held control at placed times [scaled]: its bracket, its motion [SI] and what that keeps."""

    times: Array
    bracket: Bracket
    motion: HoldTrajectory
    kept: Kept


@dataclass
class Hold:
    """The held control of one scene past the given walls.

    one: the ways past blocks that it keeps to.
    """

    scene: PointScene
    crossing: Maneuver
    job: Job
    one: WayClass | None = None
    steps: int | None = None  # holds, in place of the settings'
    count: Count = field(default_factory=Count)

    def __post_init__(self) -> None:
        task, settings = self.scene.task, self.job.settings
        self.mass, self.size = PointMass.of(self.crossing), self.scene.size
        self.circle = settings.circle.facing(Frame.from_maneuver(task).angle)
        self.grid = settings.grid if self.steps is None else Aligned(steps=self.steps)

    def best(self, times: Array) -> Found[Trajectory] | None:
        """The least peak near the obstacle times [scaled], (q,); None where nothing is found that keeps all."""
        met: list[Held] = []

        def value(at: Array) -> float:
            if over(self.job.until):
                raise OverError
            if np.any(np.diff(np.concatenate([[0.0], at, [1.0]])) < 1e-3):
                return 1e9
            held = self.at(at)
            if held is None:
                return 1e9
            met.append(held)
            return held.bracket.upper

        with suppress(OverError):
            if len(times) and isinstance(self.grid, Aligned):
                simplex = times + np.vstack([np.zeros(len(times)), 0.05 * np.eye(len(times))])
                options = {
                    "initial_simplex": np.clip(simplex, 0.01, 0.99),
                    "maxfev": MOST_TIMES,
                    "xatol": 1e-4,
                    "fatol": 1e-7,
                }
                minimize(value, times, method="Nelder-Mead", options=options)
            else:
                value(times)
        if not met:
            return None
        held = min(met, key=lambda one: one.bracket.upper)
        seconds = held.times * self.mass.time
        peak = max(held.bracket.upper * self.mass.unit, held.motion.peak())
        made = self.job.made(0, self.count)
        return Found(self.crossing, seconds, held.motion, peak, made, multipliers=held.bracket.multipliers)

    def at(self, times: Array) -> Held | None:
        """The same at these times: asks for more at the nodes until the path between them keeps everything."""
        placed = self.grid.place(times)

        def solve(asked: Rooms) -> Held | None:
            bracket = self._solve(placed, asked)
            if bracket.control is None:
                return None
            motion = self._motion(placed, bracket.control)
            return Held(placed, bracket, motion, self.scene.kept(motion))

        return asked_more(Rooms(region=FIRST_ROOM * self.size), solve, self._more, TRIES, self.job.until)

    def _more(self, held: Held, asked: Rooms) -> Rooms | None:
        """What to ask next for what is not kept."""
        kept, motion, size = held.kept, held.motion, self.size
        if kept.passed:
            return None
        least = FIRST_ROOM * size
        most = self.scene.task.max_speed or 0.0
        if kept.of("region"):
            asked = replace(asked, region=asked.region + 1.3 * kept.of("region") + least)
        if kept.of("max_speed"):
            asked = replace(asked, speed=asked.speed + 1.3 * kept.of("max_speed") + 1e-9 * most)
        if any(one.field.startswith("obstacles") for one in kept.excesses):
            # touched from the near side: what a hold bends between its ends
            bend = motion.peak() * float(np.max(np.diff(motion.nodes))) ** 2 / 8
            asked = replace(asked, sides=max(2 * asked.sides, bend))
        if deep := kept.of("blocks"):  # at first the gaps' own edges are asked for, then more
            room = asked.gaps + max(min(deep, 0.01 * size), least) if asked.gaps else 1e-9 * size
            asked = replace(asked, gaps=room, planes=tuple(self._planes_of_gaps(motion, room)))
        return asked

    def _planes_of_gaps(self, motion: HoldTrajectory, room: float) -> list[Plane]:
        if self.one is None or self.scene.classes is None:
            return []
        return self.scene.classes.planes(self.one.way, motion.node_position, room)

    def _motion(self, placed: Array, control: Array) -> HoldTrajectory:
        start, mass = self.scene.task.start, self.mass
        nodes = self.grid.edges(placed) * mass.time
        return HoldTrajectory(nodes, control * mass.unit, np.array(start.position), np.array(start.velocity))

    def _solve(self, placed: Array, asked: Rooms) -> Bracket:
        """The bracket [scaled] of the program at placed times; without control where there is none."""
        mass, edges, most = self.mass, self.grid.edges(placed), self.scene.task.max_speed
        program = StateProgram(mass, self.circle, placed, edges)
        if self.scene.task.region is not None:
            normals, offsets = inward((np.array(self.scene.task.region) - mass.origin) / mass.length)
            program.inside(normals, offsets + asked.region / mass.length)
        self._sides(program, edges, placed, asked.sides)
        program.keep(asked.planes)
        if most is not None:
            program.within(program.velocity[1:], (most - asked.speed) * mass.time / mass.length)
        self.count.compilations += 1
        self.count.solves += 1
        return program.solve(self.job.until)

    def _sides(self, program: StateProgram, edges: Array, placed: Array, room: float) -> None:
        """Ask for the near side of the user's walls before the crossing, and for the far side after it."""
        mass = self.mass
        for wall, tip, free, at in zip(self.crossing.walls, mass.tips, mass.free, placed, strict=True):
            if wall not in self.scene.task.walls:
                continue
            normal = np.array([-free[1], free[0]])
            for where, end, span in (
                (edges < at - 1e-12, np.zeros_like(tip), at),
                (edges > at + 1e-12, mass.pf, 1 - at),
            ):
                side = float(normal @ (end - tip))
                if abs(side) > 1e-12 and np.any(where):
                    # the room that is asked for shrinks towards the crossing itself
                    share = np.minimum(1.0, np.abs(edges[where] - at) / max(span, 1e-9))
                    nodes, towards = np.flatnonzero(where), math.copysign(1, side) * normal
                    program.beyond(nodes, towards, float(towards @ tip), room / mass.length * share)
