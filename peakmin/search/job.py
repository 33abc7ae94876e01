"""One task that is being solved: its settings, its time, its programs, and the account of the work."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from typing import NamedTuple

from ..deadline import after, met, over
from ..geometry.trajectory import Trajectory
from ..plan.found import Found, Made
from ..programs.convex import ready
from ..programs.least_peak import LeastPeak
from ..programs.program import Count, Programs
from ..scenes.kinds import PointProof
from ..spec.control_set import Disc, Polygon
from ..spec.maneuver import Maneuver
from ..spec.settings import Exact, Settings
from ..types import Array, Progress


class Best(NamedTuple):
    """The best obstacle times that were found [s], (q,), and M over them.

    nodes: boxes of obstacle times looked at;  proof: of all obstacle times;  others: work done besides.
    """

    least: LeastPeak
    times: Array
    nodes: int = 0
    proof: PointProof | None = None
    others: tuple[Count, ...] = ()


@dataclass(frozen=True)
class Job:
    """until: the deadline of the settings' time limit;  began: a `time.perf_counter()`."""

    settings: Settings
    until: float
    progress: Progress | None = None
    programs: Programs = field(default_factory=Programs)
    began: float = field(default_factory=time.perf_counter)

    @classmethod
    def begun(
        cls,
        settings: Settings,
        progress: Progress | None = None,
        programs: Programs | None = None,
        stopped: threading.Event | None = None,
    ) -> Job:
        """A job that begins now.

        Args:
            progress: called with (done, total).
            programs: where compiled programs are taken from; default a place of its own.
            stopped: once it is set, the time is over.
        """
        begun = cls(settings, after(settings.time_limit, stopped), progress, programs or Programs())
        if not isinstance(settings.method, Exact):
            ready()
        return begun

    def least(self, maneuver: Maneuver, circle: Disc | Polygon | None = None) -> LeastPeak:
        """M over the obstacle times of a maneuver; `circle`: in place of the settings' own."""
        return LeastPeak(maneuver, self.settings, circle, self.until, self.programs)

    def made(self, nodes: int, *counts: Count) -> Made:
        """The account of the work so far: boxes of obstacle times looked at, and what programs did."""
        return Made(
            solver=self.settings.solver,
            compilations=sum(count.compilations for count in counts),
            solves=sum(count.solves for count in counts),
            nodes=nodes,
            seconds=time.perf_counter() - self.began,
            stopped=over(self.until) or met(self.until),
        )

    def at(self, best: Best) -> Found[Trajectory]:
        """What the settings' control comes to at the best obstacle times."""
        least, times = best.least, best.times
        motion, peak, placed = least.motion(times), least.peak(times), least.place(times) * least.mass.time
        made = self.made(best.nodes, least.count, *best.others)
        return Found(least.maneuver, placed, motion, peak, made, best.proof, least(times).multipliers)
