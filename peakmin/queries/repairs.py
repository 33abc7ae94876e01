"""Changes of single entries that let a maneuver be solved, each as small as it gets and tried out."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from ..deadline import left, over
from ..errors import SpecError
from ..proofs.branch_and_bound import least_over_times
from ..proofs.double_integrator import PointMass
from ..scenes.impossible import impossible, least_way
from ..search.solve import solve
from ..spec.control_set import Disc
from ..spec.frame import Frame
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..spec.settings import Aligned, Exact, Settings

if TYPE_CHECKING:
    from ..spec.arm import ArmManeuver

LEAST = 0.05  # s, of a solve
FINEST = 1e-3  # relative: to which the least change is looked for; what is said is rounded up to three digits
ROUGH = 1e-2  # the same with blocks, a region or a speed
COARSE, STEPS = 40, 4  # holds of a quick look; changes that are tried with the real settings, each a little larger
SHARPER = 4  # halvings with the real settings
MOST = 1e3  # times the entry: larger changes are not looked for
FURTHEST = 10.0  # times the maneuver's size: nothing is moved further


@dataclass(frozen=True)
class Repair:
    """One entry changed, and solved so.

    field: its path in the maneuver;  text: the change in words;  maneuver: with it;  peak: then reached [m/s^2];
    cost: how large the change is, relative to what was there or to the maneuver's size.
    """

    field: str
    text: str
    maneuver: Maneuver | ArmManeuver
    peak: float
    cost: float


class Trials:
    """Solves of changed maneuvers, until the time is over."""

    def __init__(self, settings: Settings, until: float) -> None:
        self.settings, self.until = settings, until
        self._refuted: dict[Maneuver, float] = {}

    @property
    def over(self) -> bool:
        return over(self.until)

    def solve(self, maneuver: Maneuver, settings: Settings | None = None) -> tuple[str, float, float]:
        """Status, peak and bound [m/s^2]; "refused" where the changed maneuver is none."""
        if left(self.until) <= 0:
            return "unknown", math.inf, 0.0
        try:
            plan = solve(maneuver, limited(settings or self.settings, self.until))
        except SpecError:
            return "refused", math.inf, 0.0
        return plan.status, plan.peak, plan.lower_bound

    def refuted(self, maneuver: Maneuver) -> bool:
        """Whether it is proved impossible."""
        if impossible(maneuver) is not None or maneuver in self._refuted:
            return True
        if maneuver.max_peak is not None:
            status, _, bound = self.solve(maneuver)
            self.know(maneuver, bound if status == "infeasible" else 0.0)
        return maneuver in self._refuted

    def know(self, maneuver: Maneuver, bound: float) -> None:
        """That no control has a smaller peak than the bound [m/s^2], which may be more than allowed."""
        if maneuver.max_peak is not None and bound > maneuver.max_peak:
            self._refuted[maneuver] = bound

    def bound(self, maneuver: Maneuver) -> float:
        """A bound [m/s^2]: the one that refuted it, or a better one that needs no max_peak."""
        return max(self._refuted.get(maneuver, 0.0), self.solve(changed(maneuver, max_peak=None))[2])

    def least(self, change: Callable[[float], Maneuver | None], low: float, first: float, most: float) -> float | None:
        """About the least x above `low` that helps, at most `most` above, steps growing from `first`; or None."""
        step, high, start = first, low + first, change(low + first)
        simple = start is not None and start.simple
        while not self._helps(change(high)):
            low, step = high, 2 * step
            high = low + step
            if step > most or self.over:
                return None
        while high - low > (FINEST if simple else ROUGH) * high and not self.over:
            middle = (low + high) / 2
            low, high = (low, middle) if self._helps(change(middle)) else (middle, high)
        below = 0.0 if start is None or simple or start.blocks else high - first
        for _ in range(SHARPER):  # a quick look at a region or a speed asks for more than it takes
            if below <= ROUGH * high or self.over:
                break
            below /= 2
            maneuver = change(high - below)
            if maneuver is not None and self.solve(maneuver)[0] == "solved":
                high -= below
        return high

    def _helps(self, maneuver: Maneuver | None) -> bool:
        """Whether it is solved, as a quick look tells: at the times that are best without region and speed."""
        if self.over or maneuver is None or impossible(maneuver) is not None:
            return False
        quick: dict[str, Any] = {"grid": Aligned(steps=COARSE)}
        if maneuver.blocks:
            return self.solve(maneuver, self.settings.model_copy(update=quick))[0] == "solved"
        if maneuver.simple:
            quick = {"method": Exact()} if isinstance(self.settings.circle, Disc) else quick
            return self.solve(maneuver, self.settings.model_copy(update=quick))[0] == "solved"
        from ..search.held import KeptProgram  # cvxpy takes a second to import

        mass = PointMass.of(maneuver.past(maneuver.walls))
        circle = self.settings.circle.facing(Frame.from_maneuver(maneuver).angle)
        times = least_over_times(mass, 1e-3, until=self.until).times
        kept = KeptProgram(maneuver, maneuver.walls, circle, Aligned(steps=COARSE), until=self.until).at(times)
        return kept is not None and kept[1].upper * mass.unit <= (maneuver.max_peak or math.inf)

    def repair(
        self,
        field: str,
        x: float | None,
        change: Callable[[float], Maneuver | None],
        text: Callable[[str], str],
        cost: Callable[[float], float],
        most: int = STEPS,
    ) -> Iterator[Repair]:
        """The change by x rounded up, or by a little more where the settings' own control needs it, if that is solved.

        Args:
            text: of x in words;  most: how often a little more is tried.
        """
        for _ in range(most):
            if x is None or self.over:
                return
            x = upwards(x)
            maneuver = change(x)
            if maneuver is not None:
                status, peak, _ = self.solve(maneuver)
                if status == "solved":
                    yield Repair(field, text(f"{x:.6g}"), maneuver, peak, cost(x))
                    return
            x *= 1 + (5 * FINEST if maneuver is None or maneuver.simple else 2 * ROUGH)


def limited(settings: Settings, until: float) -> Settings:
    """Settings of one solve of many, which goes on for no longer than all of them may."""
    rest = left(until)
    if math.isinf(rest):
        return settings
    return settings.model_copy(update={"time_limit": min(max(rest, LEAST), settings.time_limit or math.inf)})


def changed(maneuver: Maneuver, **fields: object) -> Maneuver:
    """The maneuver with other entries, checked anew. Raises `SpecError`."""
    return Maneuver(**({name: getattr(maneuver, name) for name in Maneuver.model_fields} | fields))


def tried(maneuver: Maneuver, **fields: object) -> Maneuver | None:
    """The same, None where it would be refused."""
    try:
        return changed(maneuver, **fields)
    except SpecError:
        return None


def upwards(x: float, digits: int = 3) -> float:
    """The next number of so many digits [any unit]."""
    if not x > 0 or math.isinf(x):
        return x
    unit = 10.0 ** (math.floor(math.log10(x)) - digits + 1)
    return float(f"{math.ceil(x / unit * (1 - 1e-12)) * unit:.{digits}g}")


def repairs(maneuver: Maneuver, fields: tuple[str, ...], trials: Trials) -> Iterator[Repair]:
    """Changes of single entries, among these fields, that help."""
    D, v, M = maneuver.duration, maneuver.max_speed, maneuver.max_peak
    if "max_peak" in fields and M is not None:
        _, peak, _ = trials.solve(changed(maneuver, max_peak=None))
        raised = functools.partial(_with, maneuver, "max_peak")
        yield from trials.repair("max_peak", peak, raised, "raise max_peak to {} m/s²".format, lambda x: x / M - 1)
    if "duration" in fields:
        longer = functools.partial(_with, maneuver, "duration")
        x = trials.least(longer, D, 0.1 * D, MOST * D)
        yield from trials.repair(
            "duration", x, longer, f"duration {D:.6g} s is too short: {{}} s would do".format, lambda x: x / D - 1
        )
        if any(maneuver.start.velocity) and any(maneuver.goal.velocity):  # else what is quick enough can wait at rest
            shorter = functools.partial(_less, maneuver, "duration")
            yield from trials.repair(
                "duration",
                trials.least(shorter, 0.0, 0.05 * D, D),
                shorter,
                lambda x: f"duration {D:.6g} s is too long: {D - float(x):.6g} s would do",
                lambda x: x / D,
            )
    if "max_speed" in fields and v is not None:
        faster, slowest = functools.partial(_with, maneuver, "max_speed"), least_way(maneuver) / D
        x = trials.least(faster, slowest, 0.1 * slowest, MOST * slowest)
        yield from trials.repair("max_speed", x, faster, "raise max_speed to {} m/s".format, lambda x: x / v - 1)
    yield from _places(maneuver, fields, trials)


def _with(maneuver: Maneuver, field: str, x: float) -> Maneuver | None:
    return tried(maneuver, **{field: x})


def _less(maneuver: Maneuver, field: str, x: float) -> Maneuver | None:
    """With an entry less by x, by the number that is then said of it."""
    return tried(maneuver, **{field: max(float(f"{getattr(maneuver, field) - x:.6g}"), 0.0)})


def _places(maneuver: Maneuver, fields: tuple[str, ...], trials: Trials) -> Iterator[Repair]:
    """Walls drawn back, blocks left out or with less margin, a region grown."""
    points = [maneuver.start.position, maneuver.goal.position, *(wall.tip for wall in maneuver.walls)]
    size = float(np.max(np.ptp(np.array(points), axis=0))) or 1.0
    first, most, margin = 1e-3 * size, FURTHEST * size, maneuver.margin
    for i, one in enumerate(maneuver.obstacles):
        name = f"obstacles[{i}]"
        if name in fields and isinstance(one, Wall):
            back = functools.partial(_drawn_back, maneuver, i)
            verb = "lower" if one.direction[0] == 0 and one.direction[1] < 0 else "draw back"
            x = trials.least(back, 0.0, first, most)
            wider = "" if one.opening is None else ", its opening as much wider"
            yield from trials.repair(
                f"{name}.tip", x, back, f"{verb} {name}.tip by {{}} m{wider}".format, lambda x: x / size
            )
        elif name in fields:
            rest = tried(maneuver, obstacles=maneuver.obstacles[:i] + maneuver.obstacles[i + 1 :])
            words = f"leave out {name}".format
            yield from trials.repair(name, 1.0, lambda x, rest=rest: rest, words, lambda x: 1.0, most=1)  # type: ignore[misc]
    if margin and any(name.startswith("obstacles") for name in fields):
        nearer = functools.partial(_less, maneuver, "margin")
        x = trials.least(nearer, 0.0, margin / 8, margin)

        def words_of(x: str) -> str:
            return f"lower margin to {max(margin - float(x), 0.0):.6g} m"

        yield from trials.repair("margin", x, nearer, words_of, lambda x: min(x / margin, 1.0))
    if "region" in fields:

        def grown(x: float) -> Maneuver | None:
            return tried(maneuver, region=_grown(maneuver, x))

        x = trials.least(grown, 0.0, first, most)
        yield from trials.repair(
            "region", x, grown, "move the edges of region outward by {} m".format, lambda x: x / size
        )


def _drawn_back(maneuver: Maneuver, i: int, x: float) -> Maneuver | None:
    """With a wall's tip moved by x [m] along its direction; what stands across its opening stays."""
    wall = maneuver.obstacles[i]
    assert isinstance(wall, Wall)
    along = np.array(wall.direction) / math.hypot(*wall.direction)
    opening = None if wall.opening is None else wall.opening + x
    moved = wall.model_copy(update={"tip": tuple((np.array(wall.tip) + x * along).tolist()), "opening": opening})
    return tried(maneuver, obstacles=(*maneuver.obstacles[:i], moved, *maneuver.obstacles[i + 1 :]))


def _grown(maneuver: Maneuver, x: float) -> tuple[tuple[float, float], ...]:
    ring = shapely.Polygon(maneuver.region).buffer(x, join_style="mitre", mitre_limit=100).exterior
    return tuple((a, b) for a, b in list(ring.coords)[:-1])
