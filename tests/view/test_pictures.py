"""Every figure draws on the axes it is given and names its units."""

import io
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.quiver import Quiver
from PIL import Image

import peakmin as pm
from peakmin import paper
from peakmin.errors import SpecError
from peakmin.view import animation, curves, maps, paths, pictures, sketches
from peakmin.view.style import WALL, png, sheet
from tests.conftest import least, wall_maneuver
from tests.solved import solved


@pytest.fixture(params=["direct", "exact"])
def plan(request):
    yield pm.solve(wall_maneuver(), pm.Settings(method={"kind": request.param}, search={"kind": "global", "gap": 1e-3}))
    plt.close("all")


@pytest.mark.parametrize("draw", [paths.path, curves.control, curves.control_size])
def test_plans(plan, draw):
    ax = plt.figure().add_subplot()
    assert draw(plan, ax=ax) is ax
    assert "[" in ax.get_xlabel()
    assert "[" in ax.get_ylabel()


def test_a_continuous_control_is_drawn_as_a_curve_that_reaches_the_peak():
    plan = pm.solve(wall_maneuver(), pm.Settings(method=pm.Exact(), search={"kind": "global", "gap": 1e-3}))
    line = curves.control(plan, axis=1).get_lines()[0]
    assert len(line.get_xdata()) > 500
    assert np.max(np.abs(line.get_ydata())) == pytest.approx(plan.peak, rel=1e-3)
    plt.close("all")


def test_holds_are_drawn_as_steps_to_the_end():
    plan = pm.solve(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=10), search={"kind": "global", "gap": 1e-2}))
    line = curves.control(plan, axis=0).get_lines()[0]
    assert line.get_drawstyle() == "steps-post"
    t, u = line.get_data()
    assert np.array_equal(t, plan.times)
    assert np.array_equal(u[:-1], plan.trajectory.control[:, 0])
    assert u[-1] == u[-2]
    plt.close("all")


def test_overview_and_budget(plan):
    assert len(pictures.overview(plan).axes) == 2
    errors = pm.error_budget(plan.maneuver, plan.settings, plan=plan)
    ax = errors.plot()
    assert len(ax.patches) == 5
    widths = sum(patch.get_width() for patch in ax.patches)
    assert widths == pytest.approx(errors.total, abs=1e-12)


def test_sweeps_over_one_wall_only(plan):
    pm.sweep(plan.maneuver, times=[0.4, 0.5]).plot()
    with pytest.raises(ValueError, match="one wall"):
        pm.sweep(wall_maneuver(obstacles=())).plot()


def box(x0, x1, y0, y1):
    return pm.Block(vertices=[(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


@pytest.fixture(scope="module")
def scene():
    maneuver = wall_maneuver(
        obstacles=(box(0.4, 0.6, -0.3, 0.2), box(0.2, 0.3, 0.9, 9.0)),
        margin=0.02,
        region=((-0.5, -2), (1.5, -2), (1.5, 2), (-0.5, 2)),
    )
    yield pm.solve(maneuver, pm.Settings(search={"kind": "global", "gap": 0.05}))
    plt.close("all")


def labels(ax):
    return {text.get_text() for text in ax.get_legend().get_texts()}


def test_a_scene_shows_blocks_margins_region_lines_and_arrows(scene):
    ax = paths.path(scene)
    assert len([patch for patch in ax.patches if patch.get_fill()]) == 2 + 1  # blocks and the region's outline
    expected = {"block", "margin", "region", "line", "path of the centre of mass", "acceleration", "crossing"}
    assert labels(ax) == {*expected, "start", "goal"}
    (arrows,) = [item for item in ax.collections if isinstance(item, Quiver)]
    assert arrows.N == 24
    picture = max(np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim()))
    assert np.max(np.hypot(arrows.U, arrows.V)) / arrows.scale == pytest.approx(0.12 * picture)
    dotted = [line for line in ax.lines if line.get_linestyle() == ":"]
    assert len(dotted) == len(scene.walls)


def test_the_view_holds_the_path_and_cuts_what_is_far_away(scene):
    ax = paths.path(scene, arrows=0)
    assert not [item for item in ax.collections if isinstance(item, Quiver)]
    assert "acceleration" not in labels(ax)
    x, y = scene.position(np.linspace(0, scene.maneuver.duration, 333)).T
    for values, (low, high) in ((x, ax.get_xlim()), (y, ax.get_ylim())):
        assert low < np.min(values)
        assert high > np.max(values)
    assert ax.get_ylim()[0] < -0.32
    assert ax.get_ylim()[1] < 2


def test_the_legend_is_below_the_axes(scene):
    for ax in (paths.path(scene), curves.control_size(scene)):
        ax.figure.canvas.draw()
        legend = ax.get_legend().get_window_extent()
        assert legend.y1 < ax.xaxis.label.get_window_extent().y0
        assert legend.y0 >= 0


def test_a_users_wall_is_drawn_with_both_sides_of_its_opening():
    maneuver = wall_maneuver(obstacles=(pm.Wall(tip=(0.5, 0.5), opening=0.2),))
    ax = paths.path(pm.solve(maneuver, pm.Settings(search={"kind": "global", "gap": 1e-2})))
    thick = [line for line in ax.lines if line.get_linewidth() == WALL["linewidth"]]
    assert [tuple(line.get_xydata()[0]) for line in thick] == [(0.5, 0.5), (0.5, 0.7)]
    assert {"wall", "acceleration"} <= labels(ax)
    assert not {"line", "block", "margin", "region"} & labels(ax)
    plt.close("all")


def test_a_users_wall_before_a_block_is_not_drawn_as_a_line_too():
    maneuver = wall_maneuver(obstacles=(pm.Wall(tip=(0.25, 0.3)), box(0.6, 0.8, -0.1, 0.9)))
    plan = pm.solve(maneuver, pm.Settings(search={"kind": "global", "gap": 0.05}))
    dotted = [line for line in paths.path(plan).lines if line.get_linestyle() == ":"]
    assert len(dotted) == len(plan.walls) - 1
    assert all(line.get_xdata()[0] > 0.5 for line in dotted)
    plt.close("all")


def test_a_plan_without_a_control_shows_its_obstacles():
    maneuver = wall_maneuver(max_peak=1.0)
    plan = pm.solve(maneuver, pm.Settings(search={"kind": "global", "gap": 1e-2}))
    plan = replace(plan, trajectory=None)
    assert labels(paths.path(plan)) == {"wall", "start", "goal"}
    plt.close("all")


@pytest.mark.parametrize("kind", ["point", "arm"])
def test_a_plan_without_a_motion_has_one_picture_of_its_place(kind):
    plan = arm_plan() if kind == "arm" else pm.solve(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=10)))
    assert plan.kind == kind
    with_motion = pictures.figures(plan)
    assert len(with_motion["plan"].axes) == {"point": 2, "arm": 4}[kind]
    without = pictures.figures(unmoved(plan))
    assert list(without) == ["plan"]
    (ax,) = without["plan"].axes
    assert (
        labels(ax) == {"point": {"wall", "start", "goal"}, "arm": {"obstacle", "margin", "start", "goal", "base"}}[kind]
    )
    plt.close("all")


def test_a_picture_is_the_same_bytes_again_and_names_no_software():
    first, again = (png(sheet(sketches.flowchart, sketches.flowchart, size=(6, 3))) for _ in range(2))
    assert first == again
    picture = Image.open(io.BytesIO(first))
    assert picture.size == (900, 450)
    assert not {name for name in picture.info if name != "dpi"}
    assert not plt.get_fignums()


def test_the_path_of_an_arm_shows_what_it_can_reach():
    links, poses = [pm.Link(length=1, mass=1), pm.Link(length=0.8, mass=0.8)], ([0.2, 0.6], [1.4, 0.7])
    start, goal = (pm.Pose(joints=joints) for joints in poses)
    plan = pm.solve(pm.ArmManeuver(arm=pm.Arm(links=links), start=start, goal=goal, duration=1.0))
    ax = paths.arm_path(plan)
    assert {"path of the centre of mass", "acceleration", "start", "goal", "outer reach"} <= labels(ax)
    (edge,) = [line for line in ax.lines if line.get_label() == "outer reach"]
    radius = np.hypot(*(np.array(edge.get_data()) - np.array(plan.joints.chain.base)[:, None]))
    assert radius == pytest.approx(plan.joints.chain.reach[1])
    plt.close("all")


@pytest.mark.parametrize("named", ["plan", "arm", "sweep", "budget"])
def test_what_plots_itself_finds_its_painter(named):
    settings = pm.Settings(grid=pm.Aligned(steps=10))
    drawn = {
        "plan": lambda: pm.solve(wall_maneuver(), settings),
        "arm": arm_plan,
        "sweep": lambda: pm.sweep(wall_maneuver(), settings, times=[0.4, 0.5]),
        "budget": lambda: pm.error_budget(wall_maneuver(), settings),
    }[named]()
    ax = plt.figure().add_subplot()
    assert drawn.plot(ax) is ax
    assert ax.get_legend() is not None
    plt.close("all")


TWO = (pm.Wall(tip=(0.3, 0.2)), pm.Wall(tip=(0.7, -0.2), direction=(0, 1)))


def test_a_map_of_the_peak_marks_its_least():
    maneuver = wall_maneuver(obstacles=TWO)
    ax = maps.peak_map(maneuver, count=8)
    (x,), (y,) = ax.lines[-1].get_data()
    assert (x, y) == (pytest.approx(5 / 16), pytest.approx(11 / 16))
    least_peak = least(maneuver, np.array([x, y]), method={"kind": "exact"})[1]
    assert f"{least_peak:.4g} m/s²" in labels(ax).pop()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$T_1$ [s]", "$T_2$ [s]")
    assert [other.get_ylabel() for other in ax.figure.axes if other is not ax] == ["least peak [m/s²]"]
    plt.close("all")


def test_a_map_of_the_peak_marks_the_solution_that_is_asked_for():
    ax = plt.figure().add_subplot()
    maneuver, settings = wall_maneuver(obstacles=TWO), pm.Settings(search={"kind": "global", "gap": 1e-2})
    assert maps.peak_map(maneuver, settings, count=4, ax=ax) is ax
    assert labels(ax).pop().startswith("solution: ")
    plt.close("all")


@pytest.mark.parametrize(
    ("changes", "count", "message"),
    [
        ({}, 8, r"maneuver.obstacles: was 1 walls, must be 2 for a map of the peak"),
        ({"obstacles": (*TWO, box(0.4, 0.5, 2, 3))}, 8, r"maneuver.obstacles: was with blocks, must be left out .*"),
        ({"obstacles": TWO}, 2, r"count: was 2, must be at least 3"),
    ],
)
def test_a_map_of_the_peak_is_for_two_walls(changes, count, message):
    with pytest.raises(SpecError, match=f"^{message}$"):
        maps.peak_map(wall_maneuver(**changes), count=count)


@pytest.mark.parametrize(
    "draw",
    [sketches.problem, sketches.arm_problem, sketches.flowchart, sketches.circle_approximation, sketches.circle_error],
)
def test_what_is_asked_is_drawn_without_an_answer(draw):
    ax = plt.figure().add_subplot()
    asked = {
        sketches.problem: [paper.GENERAL],
        sketches.arm_problem: [paper.two_link_task()],
        sketches.circle_approximation: [pm.Polygon(segments=3)],
    }
    assert draw(*asked.get(draw, []), ax=ax) is ax
    if draw is sketches.flowchart:
        return
    units = {sketches.circle_approximation: ("u_x/M", "u_y/M"), sketches.circle_error: ("quadrant", "[%]")}
    for word, label in zip(units.get(draw, ("[m]", "[m]")), (ax.get_xlabel(), ax.get_ylabel()), strict=True):
        assert word in label
    plt.close("all")


def test_a_moving_start_shows_its_velocity():
    maneuver = wall_maneuver(start=pm.State(position=(0, 0), velocity=(0, 1)))
    ax = sketches.problem(maneuver)
    assert "velocity" in labels(ax)
    assert "velocity" not in labels(sketches.problem(wall_maneuver()))
    assert [text.get_text() for text in ax.texts] == ["t = 0", "t = 1 s", "$T_{obs}$ at (0.5, 0.5) m"]
    plt.close("all")


def test_size_peak_and_bound_can_be_told_apart_where_they_are_equal(plan):
    ax = curves.control_size(plan)
    drawn = {handle.get_label().split()[0]: handle for handle in ax.get_legend_handles_labels()[0]}
    band, bound, size = drawn["peak"], drawn["lower"], drawn["|u(t)|"]
    assert band.get_ydata()[0] == plan.peak
    assert set(bound.get_ydata()) == {plan.lower_bound}
    assert band.get_linewidth() > 3 * size.get_linewidth()
    assert band.get_zorder() < size.get_zorder()
    assert (bound.get_linestyle(), bound.get_marker()) == ("None", 6)


def unmoved(plan):
    """The plan without its motion."""
    return replace(plan, trajectory=None, **({"joints": None} if plan.kind == "arm" else {}))


def arm_plan():
    link = {"length": 4.0, "mass": 0.5, "half_width": 0.1}
    ends = {"start": pm.Pose(tip=(2.22, -2.693), elbow="up"), "goal": pm.Pose(tip=(5, 3), elbow="up")}
    arm, aside = pm.Arm(links=[pm.Link(**link)] * 2), pm.Block(vertices=[(7, -2), (8, -2), (8, -1)])
    task = pm.ArmManeuver(arm=arm, duration=5.0, obstacles=[aside], margin=0.2, **ends)
    return solved(task, pm.Settings(search={"kind": "global", "gap": 1e-2}))


def limited(plan):
    """The arm plan with limits near what it does, of its second joint, and one of its first that is far away."""
    first, second = plan.maneuver.arm.links
    found = plan.extremes
    near = {f"max_{name}": 1.1 * float(getattr(found, name)[1]) for name in ("speed", "acceleration", "torque")}
    links = (first.model_copy(update={"max_speed": 90.0}), second.model_copy(update={**near, "limits": (-3.0, 0.5)}))
    arm = plan.maneuver.arm.model_copy(update={"links": links})
    return replace(plan, maneuver=plan.maneuver.model_copy(update={"arm": arm, "max_moment": 1.2 * found.moment}))


@pytest.mark.parametrize("what", ["angle", "speed", "acceleration", "torque"])
def test_limits_are_dashed_beside_what_joints_do_unless_they_are_far_away(what):
    plan = limited(arm_plan())
    link, draw = plan.maneuver.arm.links[1], getattr(curves, f"joint_{what}s")
    ends = link.limits if what == "angle" else (-getattr(link, f"max_{what}"), getattr(link, f"max_{what}"))
    moment = plan.maneuver.max_moment
    ax = draw(plan)
    drawn = {line.get_ydata()[0] for line in ax.lines if len(line.get_ydata()) == 2}
    assert drawn == {*ends, *((-moment, moment) if what == "torque" else ())}
    said = f"limits {ends[0]:.4g} to {ends[1]:.4g}" if what == "angle" else f"limit ±{ends[1]:.4g}"
    assert {f"joint 2, {said}", "joint 1, limit ±90" if what == "speed" else "joint 1"} <= labels(ax)
    assert (f"base moment (joint 1), limit ±{moment:.4g}" in labels(ax)) == (what == "torque")
    assert not [line for line in draw(arm_plan()).lines if len(line.get_ydata()) == 2]
    plt.close("all")


def test_links_are_as_wide_as_they_are_and_margins_are_drawn():
    plan = arm_plan()
    ax = paths.poses(plan, count=3)
    (aside,) = [patch for patch in ax.patches if patch.get_label() == "obstacle"]
    links = [patch for patch in ax.patches if patch is not aside]
    assert len(links) == 2 * 3
    corners = links[0].get_path().vertices
    length = max(np.hypot(*(a - b)) for a in corners for b in corners)
    assert length == pytest.approx(4.0 + 2 * 0.1)
    assert {"margin", "obstacle", "start", "goal", "base"} <= labels(ax)
    assert len(sketches.arm_problem(plan.maneuver).patches) == 1 + 2 * 2
    force = curves.base_force(plan)
    assert any("lower bound" in label for label in labels(force))
    plt.close("all")


@pytest.mark.parametrize("kind", ["point", "arm"])
def test_an_animation_has_a_frame_for_each_instant_and_things_move_in_it(kind):
    plan = arm_plan() if kind == "arm" else pm.solve(wall_maneuver())
    film = pictures.animate(plan, frames=5)
    picture = Image.open(io.BytesIO(film))
    shots = []
    for k in range(picture.n_frames):
        picture.seek(k)
        shots.append(np.asarray(picture.convert("RGB")))
    assert len(shots) == 5
    assert all(np.any(a != b) for a, b in zip(shots, shots[1:], strict=False))
    assert film == pictures.animate(plan, frames=5)
    assert not plt.get_fignums()
    with pytest.raises(ValueError, match="no trajectory"):
        pictures.animate(unmoved(plan))


def test_a_clock_goes_where_nothing_else_moves():
    plan = pm.solve(pm.Maneuver(start=pm.State(position=(1, 1)), goal=pm.State(position=(1, 1)), duration=3.0))
    picture, left = Image.open(io.BytesIO(pictures.animate(plan, frames=4))), []
    for k in range(picture.n_frames):
        picture.seek(k)
        shot = np.asarray(picture.convert("RGB"))
        left.append(shot[:, : shot.shape[1] // 2].copy())
    assert len(left) == 4
    assert all(np.any(a != b) for a, b in zip(left, left[1:], strict=False))


def test_an_animation_lasts_as_long_as_the_motion():
    plan = pm.solve(wall_maneuver(duration=1.37))
    picture, lasts = Image.open(io.BytesIO(pictures.animate(plan))), []
    for k in range(picture.n_frames):
        picture.seek(k)
        lasts.append(picture.info["duration"])
    assert sum(lasts) == 1370
    assert len(lasts) == 48


@pytest.mark.parametrize(
    ("duration", "frames", "whole"),
    [(1e-9, 2, 4), (0.1, 5, 10), (1 / 3, 16, 33), (5.0, 60, 500), (600.0, 240, 60_000), (1e9, 240, 240 * 65_535)],
)
def test_frames_add_up_to_the_motion_as_far_as_a_gif_can_say(duration, frames, whole):
    assert animation.frames_of(duration) == frames
    lasts = animation.lasting(duration, frames)
    assert len(lasts) == frames
    assert sum(lasts) == whole
    assert 2 <= min(lasts) <= max(lasts) <= 65_535
