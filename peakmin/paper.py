"""The paper's two examples, computed anew by its own settings and held against its printed table.

Its table 1 comes from 200 time nodes spaced 1/200 s, that is 199 holds: the goal is reached at t = 0.995 s. The
obstacle times linspace(0.1, 0.9, 18) are moved to node round(T_obs/dt) - 1, and plain bisection on [0, 15] stops
when the bracket is at most 0.01 wide; the M reported is its upper end.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from . import files
from .plan.plan import Plan
from .search.solve import solve
from .search.sweep import Sweep, sweep
from .spec.arm import Arm, ArmManeuver, Link, Pose
from .spec.control_set import Disc, Polygon
from .spec.maneuver import Maneuver, State
from .spec.obstacles import Block, Wall
from .spec.settings import Bisection, Settings, SweepSearch, Uniform
from .types import Array, Axes, Json, Progress
from .view import curves, paths, sketches
from .view.style import png, sheet

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

    def document(self) -> Json:
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


def settings_for(segments: int, method: Bisection | None = BISECTION) -> Settings:
    """The paper's settings for n segments per quadrant; without a method, M as a variable."""
    chosen = {"method": method} if method else {}
    return Settings(
        circle=Polygon(segments=segments), grid=Uniform(steps=HOLDS), search=SweepSearch(), time_limit=None, **chosen
    )


def obstacle_nodes() -> Array:
    """Times [s] of the nodes that the paper's 18 obstacle times are moved to."""
    return np.asarray((np.round(NOMINAL / STEP) - 1) * STEP)


def compute(progress: Progress | None = None) -> Paper:
    """Table 1 row by row, the minimum of each row without the bisection, and the two-link example."""
    rows, least = [], []
    total = len(PRINTED) + 1
    for segments, paper_peak, paper_time, _, _ in PRINTED:
        found = sweep(GENERAL, settings_for(segments), times=obstacle_nodes())
        at = float(NOMINAL[found.winner])
        plan = sweep(GENERAL, settings_for(segments, method=None), times=obstacle_nodes()[[found.winner]]).best
        least.append(plan)
        peak = float(found.peak[found.winner])
        rows.append(Row(segments, peak, at, paper_peak, paper_time, plan.peak, found.best.made.compilations))
        if progress:
            progress(len(rows), total)
    controls = [plan.acceleration(plan.times[:-1]) for plan in least]
    differences = np.array([np.sum((b - a) ** 2, axis=0) for a, b in itertools.pairwise(controls)])
    disc = sweep(
        GENERAL, settings_for(1, None).model_copy(update={"circle": Disc()}), times=obstacle_nodes()[[found.winner]]
    ).best
    two_link = sweep(
        TWO_LINK,
        Settings(circle=Polygon(segments=5), grid=Uniform(steps=200), search=SweepSearch(count=14), time_limit=None),
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
    made = []
    for name, size, columns, painters in _panels(paper):
        made.append(Path(folder) / f"figure_{name}.png")
        files.write(made[-1], png(sheet(*painters, size=size, columns=columns)))
    return made


def _panels(paper: Paper) -> Iterator[tuple[str, tuple[float, float], int, list[Callable[[Axes], object]]]]:
    """Of each figure its name, its size [inches], how many columns it has, and what draws its panels."""
    task, n = two_link_task(), [row.segments for row in paper.rows]
    arm, best = solve(task), paper.two_link.best
    peaks, times = [row.peak for row in paper.rows], [row.obstacle_time for row in paper.rows]
    yield "01_problem", (6, 4.5), 1, [partial(sketches.problem, GENERAL)]
    yield "02_flowchart", (6.5, 6.5), 1, [sketches.flowchart]
    yield "03_circle", (4.5, 4.5), 1, [partial(sketches.circle_approximation, Polygon(segments=5))]
    yield "04_two_link_task", (7, 6), 1, [partial(sketches.arm_problem, task)]
    yield "05_control", (9, 7.5), 2, [partial(_control, paper, k, axis) for k in (1, 3, 5) for axis in (0, 1)]
    yield (
        "06_over_n",
        (13, 3.8),
        3,
        [
            partial(curves.over_segments, n, peaks, "least M [m/s²]", limit=paper.disc.peak),
            lambda ax: curves.over_segments(n, times, "$T_{obs}$ [s]", ax).set_ylim(0, GENERAL.duration),
            partial(curves.control_differences, n[1:], paper.differences),
        ],
    )
    yield "07_two_link_peak", (6, 4), 1, [partial(curves.peak_over_time, paper.two_link)]
    two_link = [partial(curves.control, best, axis) for axis in (0, 1)]
    yield "08_two_link_control", (13, 4), 3, [*two_link, partial(paths.path, best)]
    yield "09_two_link_poses", (7, 6), 1, [partial(paths.poses, arm)]
    yield "10_two_link_angles", (7, 4.5), 1, [partial(curves.joint_angles, arm)]
    yield "11_circle_error", (6, 4), 1, [partial(sketches.circle_error, range(1, 11))]


def _control(paper: Paper, segments: int, axis: int, ax: Axes) -> None:
    """One component of the controls for n segments and for the disc."""
    curves.control(paper.least[segments - 1], axis, ax=ax, label=f"n = {segments}")
    curves.control(paper.disc, axis, ax=ax, label="disc", dashes="--")
    ax.legend(loc=("upper right", "upper center")[axis])
