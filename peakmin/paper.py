"""The paper's two examples, computed anew by its own settings and held against its printed table.

Its table 1 comes from 200 time nodes spaced 1/200 s, that is 199 holds: the goal is reached at t = 0.995 s. The
obstacle times linspace(0.1, 0.9, 18) are moved to node round(T_obs/dt) - 1, and plain bisection on [0, 15] stops
when the bracket is at most 0.01 wide; the M reported is its upper end.
"""

from __future__ import annotations

import io
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import files
from .plan.plan import Plan
from .search.sweep import Sweep, sweep
from .spec.control_set import Disc, Polygon
from .spec.maneuver import Maneuver, State
from .spec.obstacles import Block, Wall
from .spec.settings import Bisection, Settings, SweepSearch, Uniform
from .types import Array, Progress

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .spec.arm import ArmManeuver

STEP = 1 / 200  # [s] between the paper's nodes
HOLDS = 199
NOMINAL = np.linspace(0.1, 0.9, 18)  # [s] obstacle times as the paper names them
# Printed in the paper's table 1, for comparison only: n, M_min [m/s^2], T_obs [s], squared control differences.
PRINTED: list[tuple[int, float, float, float, float]] = [
    (1, 10.4224, 0.5235, 152.69, 238.4),
    (2, 9.0234, 0.5235, 73.67, 37.3),
    (3, 8.7964, 0.5235, 35.78, 12.57),
    (4, 8.7671, 0.5235, 12.37, 7.29),
    (5, 8.7451, 0.5235, 0.0, 0.0),
]
BISECTION = Bisection(upper=15.0, tolerance=0.01, verified=False)

GENERAL = Maneuver(
    start=State(position=(0.0, 0.0)),
    goal=State(position=(1.0, 0.0)),
    duration=HOLDS * STEP,
    obstacles=(Wall(tip=(0.5, 0.5), contact="touch"),),
)
TWO_LINK = Maneuver(  # the two-link manipulator in the space of its centre of mass
    start=State(position=(2.5, -0.2)),
    goal=State(position=(3.45, 1.2)),
    duration=5.0,
    obstacles=(Wall(tip=(2.82, 1.3), contact="touch"),),
)
TABLE = (5.478, -0.306)  # [m] where the tip is when the centre of mass stands at the wall's tip
BOX = 7.05  # [m] its left side: the goal is 1 cm before it


def two_link_task() -> ArmManeuver:
    """The two-link manipulator in its workspace (figure 4): from below the table to the box that stands on it."""
    from .spec.arm import Arm, ArmManeuver, Link, Pose

    edge, top = TABLE
    box = [(BOX, top), (BOX + 0.85, top), (BOX + 0.85, 0.53), (BOX, 0.53)]
    table = [(edge, top), (8.4, top), (8.4, top - 0.294), (edge, top - 0.294)]
    return ArmManeuver(
        arm=Arm(links=(Link(length=4.0, mass=0.5, com=2.0),) * 2),
        start=Pose(tip=(2.22, -2.693), elbow="up"),
        goal=Pose(tip=(7.0394, 0.5228), elbow="up"),
        duration=5.0,
        obstacles=(Block(vertices=tuple(table)), Block(vertices=tuple(box))),
    )


@dataclass(frozen=True)
class Row:
    """One row of table 1: computed [m/s^2, s] and printed, with the minimum on the same grid."""

    segments: int
    peak: float
    obstacle_time: float
    paper_peak: float
    paper_obstacle_time: float
    minimum: float
    compilations: int

    @property
    def agrees(self) -> bool:
        """Whether both numbers agree to the four printed decimals."""
        return round(self.peak, 4) == self.paper_peak and round(self.obstacle_time, 4) == self.paper_obstacle_time


@dataclass(frozen=True)
class Paper:
    """Everything that `peakmin paper` computes. differences: squared control differences, shape (4, 2)."""

    rows: list[Row]
    least: list[Plan]
    differences: Array
    disc: Plan
    two_link: Sweep

    @property
    def agrees(self) -> bool:
        """Whether every row of table 1 agrees with the paper."""
        return all(row.agrees for row in self.rows)

    def document(self) -> dict[str, Any]:
        """The results as plain JSON data."""
        return {
            "version": 1,
            "agrees": self.agrees,
            "table1": [{**vars(row), "agrees": row.agrees} for row in self.rows],
            "squared_control_differences": [
                {"from": printed[0], "to": printed[0] + 1, "x": x, "y": y, "paper_x": printed[3], "paper_y": printed[4]}
                for printed, (x, y) in zip(PRINTED, self.differences.tolist(), strict=False)
            ],
            "disc_on_the_same_grid": self.disc.peak,
            "two_link": self.two_link.document(),
        }


def settings(segments: int, method: Bisection | None = BISECTION) -> Settings:
    """The paper's settings for n segments per quadrant; without a method, M as a variable."""
    chosen = {"method": method} if method else {}
    return Settings(circle=Polygon(segments=segments), grid=Uniform(steps=HOLDS), search=SweepSearch(), **chosen)


def obstacle_nodes() -> Array:
    """Times [s] of the nodes that the paper's 18 obstacle times are moved to."""
    return np.asarray((np.round(NOMINAL / STEP) - 1) * STEP)


def compute(progress: Progress | None = None) -> Paper:
    """Table 1 row by row, the minimum of each row without the bisection, and the two-link example."""
    rows, least = [], []
    total = len(PRINTED) + 1
    for segments, paper_peak, paper_time, _, _ in PRINTED:
        found = sweep(GENERAL, settings(segments), times=obstacle_nodes())
        at = float(NOMINAL[found.winner])
        plan = sweep(GENERAL, settings(segments, method=None), times=obstacle_nodes()[[found.winner]]).best
        least.append(plan)
        peak = float(found.peak[found.winner])
        rows.append(Row(segments, peak, at, paper_peak, paper_time, plan.peak, found.best.made.compilations))
        if progress:
            progress(len(rows), total)
    controls = [plan.acceleration(plan.times[:-1]) for plan in least]
    differences = np.array([np.sum((b - a) ** 2, axis=0) for a, b in itertools.pairwise(controls)])
    disc = sweep(
        GENERAL, settings(1, None).model_copy(update={"circle": Disc()}), times=obstacle_nodes()[[found.winner]]
    ).best
    two_link = sweep(
        TWO_LINK, Settings(circle=Polygon(segments=5), grid=Uniform(steps=200), search=SweepSearch(count=14))
    )
    if progress:
        progress(total, total)
    return Paper(rows, least, differences, disc, two_link)


def text(paper: Paper) -> str:
    """Table 1 beside the paper's numbers, and what else there is to say."""
    lines = [
        "Table 1: least M by plain bisection on [0, 15] to 0.01 (upper end), 199 holds, 18 obstacle times",
        "  n      M [m/s²]   paper     diff      T_obs [s]  paper    diff      minimum on the grid",
    ]
    for row in paper.rows:
        shown, at = round(row.peak, 4), round(row.obstacle_time, 4)
        lines.append(
            f"  {row.segments}  {row.peak:12.5f}  {row.paper_peak:8.4f}  {shown - row.paper_peak:+.4f}"
            f"  {row.obstacle_time:12.5f}  {row.paper_obstacle_time:.4f}  {at - row.paper_obstacle_time:+.4f}"
            f"  {row.minimum:10.4f}{'' if row.agrees else '   DIFFERS'}"
        )
    lines.append(f"  disc (SOCP) on the same grid and node: {paper.disc.peak:.4f} m/s²")
    lines.append("")
    lines.append("Squared control differences between n+1 and n, at the minimum")
    lines.append("  n+1 - n         x     paper          y     paper   [m²/s⁴]")
    for n, (x, y) in enumerate(paper.differences, 1):
        lines.append(f"   {n + 1} - {n}  {x:10.1f}  {PRINTED[n - 1][3]:8.2f}  {y:9.1f}  {PRINTED[n - 1][4]:8.2f}")
    lines += [
        "  These depend on which of many feasible controls a solver returns and on a sampling that the paper does",
        "  not state. At the minimum they are about ten times the paper's, fall at about its rate, and are not zero",
        "  at n = 5.",
        "",
    ]
    best, sweep_ = paper.two_link.best, paper.two_link
    lines.append(
        f"Two-link manipulator, CM space, n = 5, T = 5 s, 14 obstacle times: least M "
        f"{best.peak:.6f} m/s² at T_obs = {float(sweep_.obstacle_times[sweep_.winner]):.4f} s, "
        f"peak base force {best.peak_force:.6f} N for 1 kg"
    )
    lines.append(
        "All five rows agree with the paper." if paper.agrees else "AT LEAST ONE DIGIT DIFFERS FROM THE PAPER."
    )
    return "\n".join(lines) + "\n"


def figures(paper: Paper, folder: str | Path) -> list[Path]:
    """Pictures like the paper's figures 1 to 11 as PNG; the files written."""
    import matplotlib.pyplot as plt

    from .api import solve
    from .view import plots

    made: list[Path] = []
    task = two_link_task()
    arm = solve(task)

    def save(name: str, draw: Callable[..., Any], rows: int, columns: int, size: tuple[float, float]) -> None:
        with plt.rc_context(plots.STYLE):
            figure, axes = plt.subplots(rows, columns, figsize=size, squeeze=False)
            draw(*axes.ravel())
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", metadata={"Software": None})
        plt.close(figure)
        made.append(Path(folder) / f"figure_{name}.png")
        files.write(made[-1], buffer.getvalue())

    def control(*panels: Axes) -> None:
        for k, ax in enumerate(panels):
            segments = (1, 3, 5)[k // 2]
            plots.control(paper.least[segments - 1], k % 2, ax=ax, label=f"n = {segments}")
            plots.control(paper.disc, k % 2, ax=ax, label="disc", dashes="--")
            ax.legend(loc=("upper right", "upper center")[k % 2])

    def over_n(peak: Axes, time: Axes, difference: Axes) -> None:
        n = [row.segments for row in paper.rows]
        plots.over_segments(n, [row.peak for row in paper.rows], "least M [m/s²]", peak, paper.disc.peak)
        plots.over_segments(n, [row.obstacle_time for row in paper.rows], "$T_{obs}$ [s]", time)
        time.set_ylim(0, GENERAL.duration)
        plots.control_differences(n[1:], paper.differences, difference)

    def two_link(x: Axes, y: Axes, way: Axes) -> None:
        for axis, ax in enumerate((x, y)):
            plots.control(paper.two_link.best, axis, ax=ax)
        plots.path(paper.two_link.best, ax=way)

    save("01_problem", lambda ax: plots.problem(GENERAL, ax), 1, 1, (6, 4.5))
    save("02_flowchart", plots.flowchart, 1, 1, (6.5, 6.5))
    save("03_circle", lambda ax: plots.circle_approximation(Polygon(segments=5), ax), 1, 1, (4.5, 4.5))
    save("04_two_link_task", lambda ax: plots.task(task, ax), 1, 1, (7, 6))
    save("05_control", control, 3, 2, (9, 7.5))
    save("06_over_n", over_n, 1, 3, (13, 3.8))
    save("07_two_link_peak", lambda ax: plots.peak_over_time(paper.two_link, ax), 1, 1, (6, 4))
    save("08_two_link_control", two_link, 1, 3, (13, 4))
    save("09_two_link_poses", lambda ax: plots.poses(arm, ax), 1, 1, (7, 6))
    save("10_two_link_angles", lambda ax: plots.joint_angles(arm, ax), 1, 1, (7, 4.5))
    save("11_circle_error", lambda ax: plots.circle_error(ax=ax), 1, 1, (6, 4))
    return made
