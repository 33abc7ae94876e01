"""Where the error of a setting comes from: M(settings) - M(true), split along the way from one to the other."""

from __future__ import annotations

from dataclasses import dataclass

from ..byname import found
from ..plan.plan import Plan
from ..programs.least_peak import LeastPeak
from ..search.solve import solve
from ..spec.control_set import Disc
from ..spec.maneuver import Maneuver, walls_only
from ..spec.settings import Bisection, Direct, Exact, GlobalSearch, Settings
from ..types import Axes


@dataclass(frozen=True)
class ErrorBudget:
    """Signed parts [m/s^2] that add up to `stated - true`.

    tolerance : the bisection stopped early;  polygon : the circle was one;  grid : the control was held, at
    obstacle times that the grid allows;  obstacle_times : others would have been better;
    maneuver : the maneuver itself was not the one meant (0 unless one was named).
    stated : the plan's peak;  true : the least peak in continuous time over all obstacle times, known to `width`.
    """

    stated: float
    tolerance: float
    polygon: float
    grid: float
    obstacle_times: float
    maneuver: float
    true: float
    width: float

    @property
    def parts(self) -> dict[str, float]:
        """The parts by name, in the order of the way from stated to true [m/s^2]."""
        names = ("tolerance", "polygon", "grid", "obstacle_times", "maneuver")
        return {name: getattr(self, name) for name in names}

    @property
    def total(self) -> float:
        """stated - true [m/s^2]."""
        return self.stated - self.true

    def table(self) -> str:
        """The budget as lines of text."""
        lines = [f"{'stated peak':18} {self.stated:14.8g} m/s²"]
        for name, part in self.parts.items():
            lines.append(f"  {name.replace('_', ' '):16} {part:+14.6e} m/s²  {100 * part / (self.true or 1):+8.4f} %")
        lines.append(f"{'true least peak':18} {self.true:14.8g} m/s², proved to {self.width:.1e}")
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The parts as a stacked bar."""
        return found("peakmin.view.curves:error_parts")(self, ax=ax)


def error_budget(
    maneuver: Maneuver, settings: Settings | None = None, meant: Maneuver | None = None, plan: Plan | None = None
) -> ErrorBudget:
    """Split M(settings) - M(true) into what each approximation costs.

    The way: the settings' own answer; the same without the bisection's tolerance; with the disc for the polygon; in
    continuous time at the same obstacle times; at the best obstacle times (certified); for the maneuver meant.

    Args:
        maneuver: with walls or without.
        settings: what is to be explained; with a circumscribed polygon its part may be negative.
        meant: the maneuver that `maneuver` stands for, if another (the paper's table reaches the goal a step early).
        plan: the settings' own answer, when it is there already.

    Raises:
        SpecError: when the settings do not fit the maneuver.
    """
    settings = settings or Settings()
    walls_only(maneuver, "an error budget")
    plan = plan or solve(maneuver, settings)
    times = plan.obstacle_times

    def peak(**changes: object) -> float:
        least = LeastPeak(maneuver, Settings(**{**dict(settings), **changes}))
        return least.bound(times)

    bisected = isinstance(settings.method, Bisection)
    direct = peak(method=Direct()) if bisected else plan.peak
    exact = isinstance(settings.method, Exact)
    solver = "CLARABEL" if settings.solver not in ("CLARABEL", "SCS") else settings.solver
    disc = direct if exact or isinstance(settings.circle, Disc) else peak(method=Direct(), circle=Disc(), solver=solver)
    there = direct if exact else peak(method=Exact(), circle=Disc(), solver=solver)
    certified = Settings(
        method=Exact(),
        search=GlobalSearch(gap=1e-7),
        node_limit=settings.node_limit,
        time_limit=settings.time_limit,  # what it leaves is in the width
    )
    best = solve(maneuver, certified)
    true = best if meant is None else solve(meant, certified)
    return ErrorBudget(
        stated=plan.peak,
        tolerance=plan.peak - direct,
        polygon=direct - disc,
        grid=disc - there,
        obstacle_times=there - best.peak,
        maneuver=best.peak - true.peak,
        true=true.peak,
        width=float(true.peak - true.lower_bound),
    )
