"""A held control whose path keeps a region, a speed, and the near and far sides of walls, at given obstacle times.

These hold at every instant, so no finite set of equations states them: they are asked for at the nodes, a little more
than needed, until the path between the nodes keeps them too (`peakmin.scenes.kept`). For fixed times it is one program,

    maximise kappa = 1/M  subject to  v_k in shape,  A v = kappa b,   n . r_k >= kappa c,   |V_k| <= kappa max_speed

with r and V the position and velocity at the nodes, kappa times as large. The lower bound stays that of the problem
without these conditions. A region, a speed, and "near side until the first crossing" are conditions of the problem or
of every path that crosses first at T_i; "far side from then on" is a choice, and may cost something.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import minimize

from ..deadline import OverError, over
from ..geometry.trajectory import HoldTrajectory
from ..programs.compiled import Count
from ..programs.states import StateProgram
from ..proofs.bracket import Bracket
from ..proofs.double_integrator import PointMass
from ..scenes.blocks import Cells, Way
from ..scenes.kept import Keeping, extent, inward, keeping
from ..spec.control_set import Disc, Polygon
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..spec.settings import Aligned, Uniform
from ..types import Array

TRIES = 6  # of asking a little more
FIRST_ROOM = 1e-9  # of the scene: asked more than needed at first
MOST_TIMES = 25  # obstacle times looked at around the first ones


@dataclass
class KeptProgram:
    """The program of one maneuver past the given walls."""

    maneuver: Maneuver
    walls: tuple[Wall, ...]
    circle: Disc | Polygon
    grid: Uniform | Aligned
    count: Count = field(default_factory=Count)
    cells: Cells | None = None
    way: Way = ()
    until: float = math.inf  # a deadline

    def __post_init__(self) -> None:
        self.mass = PointMass.of(self.maneuver.past(self.walls))
        self.size = extent(self.maneuver)

    def best(self, times: Array) -> tuple[Array, Bracket, HoldTrajectory] | None:
        """The least peak near the obstacle times [scaled], (q,): placed times, bracket, motion; or None."""
        found: list[tuple[float, Array, Bracket, HoldTrajectory]] = []

        def value(at: Array) -> float:
            if over(self.until):
                raise OverError
            if np.any(np.diff(np.concatenate([[0.0], at, [1.0]])) < 1e-3):
                return 1e9
            kept = self.at(at)
            if kept is None:
                return 1e9
            found.append((kept[1].upper, *kept))
            return kept[1].upper

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
        return min(found, key=lambda one: one[0])[1:] if found else None

    def at(self, times: Array) -> tuple[Array, Bracket, HoldTrajectory] | None:
        """The same at these times: asks for more at the nodes until the path between them keeps everything."""
        placed = self.grid.place(times)
        room = {"sides": 0.0, "region": FIRST_ROOM * self.size, "speed": 0.0, "gaps": 0.0}
        gaps: list[tuple[int, Array, float]] = []
        for _ in range(TRIES):
            if over(self.until):
                return None
            bracket = self._solve(placed, room, gaps)
            if bracket.control is None:
                return None
            motion = self._motion(placed, bracket.control)
            kept = keeping(self.maneuver, motion)
            if kept.passed(self.maneuver):
                return placed, bracket, motion
            self._ask_more(motion, kept, room)
            if not kept.blocks >= 0:
                gaps = self._gaps(motion, room["gaps"])
        return None

    def _gaps(self, motion: HoldTrajectory, room: float) -> list[tuple[int, Array, float]]:
        """For every node the edges of the gap of the way that it is over or nearest to: n . r >= c, as (node, n, c)."""
        out: list[tuple[int, Array, float]] = []
        if self.cells is None:
            return out
        frame, lines = self.cells.frame, self.cells.lines
        for node, (x, y) in enumerate(frame.position(motion.node_position)):
            if not 0 < x < self.cells.length:
                continue
            for k in {int(np.searchsorted(lines, x + shift)) - 1 for shift in (-room, room)}:
                if not 0 <= k < len(self.way):
                    continue
                sections = [(g, self.cells.gaps[k][g].at(x)) for g in self.way[k]]
                best = min(sections, key=lambda one: max(one[1][0] - y, y - one[1][1]))[0]
                gap = self.cells.gaps[k][best]
                for sign, (begin, end) in ((1, gap.low), (-1, gap.high)):
                    if math.isfinite(begin):
                        step = np.array([gap.across[1] - gap.across[0], end - begin])
                        normal = sign * np.array([-step[1], step[0]]) / np.hypot(*step)
                        turned = frame.vector_back(normal)
                        out.append((node, turned, float(turned @ frame.position_back([gap.across[0], begin])) + room))
        return out

    def _ask_more(self, motion: HoldTrajectory, kept: Keeping, room: dict[str, float]) -> None:
        if not kept.region >= 0:
            room["region"] += 1.3 * -kept.region + FIRST_ROOM * self.size
        if self.maneuver.max_speed is not None and kept.speed > self.maneuver.max_speed:
            room["speed"] += 1.3 * (kept.speed - self.maneuver.max_speed) + 1e-9 * self.maneuver.max_speed
        if not kept.walls >= 0:  # touched from the near side: what a hold bends between its ends
            bend = motion.peak() * float(np.max(np.diff(motion.nodes))) ** 2 / 8
            room["sides"] = max(2 * room["sides"], bend)
        if not kept.blocks >= 0:  # at first the gaps' own edges are asked for, then more
            room["gaps"] += (
                max(min(-kept.blocks, 0.01 * self.size), FIRST_ROOM * self.size) if room["gaps"] else 1e-9 * self.size
            )

    def _motion(self, placed: Array, control: Array) -> HoldTrajectory:
        start, mass = self.maneuver.start, self.mass
        nodes = self.grid.edges(placed) * mass.time
        return HoldTrajectory(nodes, control * mass.unit, np.array(start.position), np.array(start.velocity))

    def _solve(self, placed: Array, room: dict[str, float], gaps: list[tuple[int, Array, float]]) -> Bracket:
        """The bracket [scaled] of the program at placed times; without control where there is none."""
        mass, edges = self.mass, self.grid.edges(placed)
        program = StateProgram(mass, self.circle, placed, edges)
        program.constraints += self._planes(program.position, program.kappa, edges, placed, room)
        program.keep(gaps)
        if self.maneuver.max_speed is not None:
            program.within(program.velocity[1:], (self.maneuver.max_speed - room["speed"]) * mass.time / mass.length)
        self.count.compilations += 1
        self.count.solves += 1
        return program.solve(self.until)

    def _planes(self, r: Any, kappa: Any, edges: Array, placed: Array, room: dict[str, float]) -> list[Any]:
        """n . r_k >= kappa c: the region at every node, the lines of the user's walls before and after the crossing."""
        mass, out = self.mass, []
        if self.maneuver.region is not None:
            normals, offsets = inward((np.array(self.maneuver.region) - mass.origin) / mass.length)
            out.append(r @ normals.T >= kappa * (offsets + room["region"] / mass.length))
        for wall, tip, free, at in zip(self.walls, mass.tips, mass.free, placed, strict=True):
            if wall not in self.maneuver.walls:
                continue
            normal = np.array([-free[1], free[0]])
            for where, end, span in ((edges < at - 1e-12, np.zeros(2), at), (edges > at + 1e-12, mass.pf, 1 - at)):
                side = float(normal @ (end - tip))
                if abs(side) > 1e-12 and np.any(where):
                    # the room that is asked for shrinks towards the crossing itself
                    share = np.minimum(1.0, np.abs(edges[where] - at) / max(span, 1e-9))
                    keep = room["sides"] / mass.length * share
                    out.append(
                        math.copysign(1, side) * (r[np.flatnonzero(where)] @ normal - kappa * (normal @ tip))
                        >= kappa * keep
                    )
        return out
