"""What is said of plans of one kind only: what they keep, what they do not, and what may help."""

from __future__ import annotations

import math

from ..geometry.norm import length
from ..plan.arm_plan import ArmPlan
from ..plan.plan import Plan
from ..plan.reason import not_kept
from ..spec.arm import ArmManeuver
from ..spec.control_set import Disc
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Block
from ..spec.settings import Exact

KEPT = 1e-6  # of the reach that a path leaves [m], or more, is spoken
TURN = math.tau * (1 + 1e-9)  # rad: joint angles beyond it, and
FAST = 20.0  # rad/s: speeds of joints above it may have been meant in degrees
LONG = 20.0  # m: links above it, and
FAR, HASTE = 100.0, 200.0  # m, m/s^2: ways above it that need so much may have been meant in millimetres


def line(name: str, said: str) -> str:
    """One line under an answer."""
    return f"  {name:<14}  {said}"


# a centre of mass


def point_units(task: Maneuver) -> list[str]:
    """Places that look like millimetres."""
    way = length(tuple(b - a for a, b in zip(task.start.position, task.goal.position, strict=True)))
    needed = 4 * way / task.duration**2  # of the straight way from rest to rest: M = 4 d / T^2
    if way <= FAR or needed <= HASTE:
        return []
    return [line("metres", f"start and goal are {way:g} m apart, {needed:.3g} m/s² in {task.duration:g} s: not mm?")]


def point_bounded(plan: Plan) -> str:
    """Of what the lower bound is one."""
    return f"any control, over {'every obstacle time' if plan.scope == 'all' else 'these obstacle times only'}"


def point_made(plan: Plan) -> str:
    """How the plan was made."""
    made = plan.made
    return (
        f"{made.solver}, search {plan.settings.search.kind}, {made.solves} solves of "
        f"{made.compilations} compiled programs, {made.nodes} boxes, {made.seconds:.2f} s"
    )


def point_facts(plan: Plan) -> list[str]:
    """When lines are crossed, how near the path comes, and what it does not keep."""
    lines = [line("obstacle times", ", ".join(f"{t:.6g} s" for t in plan.obstacle_times) or "none")]
    if math.isfinite(plan.clearance):
        lines.append(line("clearance", f"{plan.clearance:.6g} m at every instant{_near(plan, ', ', 'inside')}"))
    if not plan.keeps and plan.trajectory is not None:
        lines += [line("not kept", one) for one in not_kept(plan)]
    return lines


def point_holds(plan: Plan) -> list[str]:
    """Of a control past q walls on fewer than q + 2 holds: one for each segment, and one more to stop at the goal."""
    steps, least = plan.settings.grid.steps, len(plan.crossing.walls) + 2
    if isinstance(plan.settings.method, Exact) or steps >= least:
        return []
    none = "no control on these holds" if steps < least - 1 else "no control was found on these holds"
    return [
        f"{none}, {steps} in {least - 1} segments; none is below {plan.lower_bound:.6g} m/s²",
        f"steps: at least {least} here",
    ]


def point_tries(plan: Plan) -> list[str]:
    """Changes of what was asked that may help a path that does not keep it."""
    if plan.kept is None:
        return []
    asked, kept, out = plan.maneuver, plan.kept, []
    if any(one.field.startswith("obstacles") for one in kept.excesses) and len(asked.walls) > 1:
        out.append("the walls in another order: they are passed as they are listed")
    if kept.of("max_speed"):
        out.append("a larger max_speed, or a longer duration")
    if kept.of("region") and asked.blocks:
        out.append("the other side of a block: side left or right")
    return out


# an arm


def arm_units(task: ArmManeuver) -> list[str]:
    """Angles and speeds that look like degrees, lengths that look like millimetres."""
    return [*_degrees(task), *_long_links(task)]


def _degrees(task: ArmManeuver) -> list[str]:
    poses = (("start", task.start), ("goal", task.goal))
    angles = [(f"{name}.joints[{i}]", q) for name, pose in poses for i, q in enumerate(pose.joints or ())]
    links = list(enumerate(task.arm.links))
    angles += [(f"arm.links[{i}].limits", q) for i, link in links for q in link.limits or ()]
    speeds = [(f"arm.links[{i}].max_speed", link.max_speed) for i, link in links if link.max_speed is not None]
    return [
        *(
            line("radians", f"{field} is {q:g} rad, {abs(q) / math.tau:.3g} turns")
            for field, q in angles
            if abs(q) > TURN
        ),
        *(
            line("radians", f"{field} is {speed:g} rad/s, {speed / math.tau:.3g} turns a second: not degrees?")
            for field, speed in speeds
            if speed > FAST
        ),
    ]


def _long_links(task: ArmManeuver) -> list[str]:
    long = [(i, link.length) for i, link in enumerate(task.arm.links) if link.length > LONG]
    return [line("metres", f"arm.links[{i}].length is {size:g} m: not mm?") for i, size in long]


def arm_bounded(plan: ArmPlan) -> str:
    """Of what the lower bound is one."""
    return "any motion of the arm"


def arm_made(plan: ArmPlan) -> str:
    """How the plan was made."""
    return f"{plan.made.solver}, {plan.made.nodes} boxes of obstacle times bounded, {plan.made.seconds:.2f} s"


def arm_facts(plan: ArmPlan) -> list[str]:
    """What the arm touches, how its elbow bends, how near it comes, and what it does not keep."""
    touched = zip(plan.contact_times, plan.contacts, strict=True)
    lines = [line("contact", f"{t:.6g} s: {contact}") for t, contact in touched]
    if plan.joints is not None and plan.joints.chain.links == 2:
        word = {-1.0: "up", 1.0: "down"}[plan.joints.elbow]
        turned = "".join(f", turns over at {t:.6g} s" for t in plan.elbow_changes)
        lines.append(line("elbow", f"{word} at the start{turned}"))
    if math.isfinite(plan.clearance):
        near = _near(plan, ": ", "a link is inside")
        lines.append(line("clearance", f"{plan.clearance:.6g} m of every link at every instant{near}"))
    if plan.passing_over:
        pairs = ", ".join(f"{i + 1} and {j + 1} about {t:.3g} s" for i, j, t in plan.passing_over)
        lines.append(line("links", f"pass over one another: {pairs}; arm.self_margin keeps them apart"))
    return [*lines, *_joint_peaks(plan), *_arm_fails(plan)]


def _joint_peaks(plan: ArmPlan) -> list[str]:
    """What the base and every joint feel and do at most at any instant, beside their limits; how near to singular.

    Limits in brackets are not given: what counts in their place.
    """
    found, may = plan.extremes, plan.allowed
    if found is None or may is None:
        return []
    bound = "" if plan.maneuver.max_moment is None else f" of {plan.maneuver.max_moment:.4g}"
    lines = [line("base moment", f"{found.moment:.5g}{bound} N m at most")]
    for k, link in enumerate(plan.maneuver.arm.links):
        of = "" if link.limits is None else f" of {link.limits[0]:.4g} to {link.limits[1]:.4g}"
        said = [f"{found.low[k]:.4g} to {found.high[k]:.4g}{of} rad"]
        for name, unit in (("speed", "rad/s"), ("acceleration", "rad/s²"), ("torque", "N m")):
            size, most = getattr(found, name)[k], f"{getattr(may, name)[k]:.4g}"
            of = f"({most})" if getattr(link, f"max_{name}") is None else most
            said.append(f"{size:.4g} of {of} {unit}" if math.isfinite(size) else f"no bound known, of {of} {unit}")
        lines.append(line(f"joint {k + 1}", ", ".join(said)))
    return [*lines, line("singular", f"{found.singular:.3g} m from it at least (of dc/dq)")]


def _arm_fails(plan: ArmPlan) -> list[str]:
    """What the motion found does not keep, or why there is none."""
    lines, clear = [], plan.clear
    if clear is not None and clear.within < -KEPT:
        lines.append(line("reach", f"the path leaves it by {-clear.within:.6g} m"))
    if clear is not None and not clear.steady:
        lines.append(line("joints", "jump where the folded arm passes its base"))
    lines += [line("not kept", one) for one in plan.exceeded]
    if math.isinf(plan.lower_bound):
        lines.append(line("closed", "obstacles and reach leave no way from start to goal (proved)"))
    elif plan.joints is None:
        lines.append("  no free motion was found; the bound holds all the same")
    return lines


def arm_tries(plan: ArmPlan) -> list[str]:
    """Changes of what was asked that may help a motion that does not keep it."""
    tries = {
        "limits": "wider limits, the other elbow, or other poses",
        "max_speed": "a larger max_speed, or a longer duration",
        "max_acceleration": "a larger max_acceleration, or a longer duration",
        "max_torque": "a larger max_torque, or a longer duration",
        "self_margin": "a smaller self_margin, or other poses",
    }
    return [text for name, text in tries.items() if any(f".{name}:" in one for one in plan.exceeded)]


def arm_finer(plan: ArmPlan) -> list[str]:
    """What lets a smaller peak be asked for: joints have holds of their own, finer settings do not help."""
    return ["a larger max_peak, or a longer duration"] if plan.peak > plan.maneuver.limit else []


# all


def finer(plan: Plan) -> list[str]:
    """What a path that is better by a little may need."""
    settings = plan.settings
    out = [f"more steps: {2 * settings.grid.steps} in place of {settings.grid.steps}"]
    if isinstance(settings.circle, Disc) and not isinstance(settings.method, Exact):
        out.append("method exact, in continuous time")
    if any(isinstance(one, Block) for one in plan.maneuver.obstacles):
        out.append(f"more rounds: {2 * settings.rounds} in place of {settings.rounds}")
    return out


def _near(plan: Plan, but: str, inside: str) -> str:
    """What is wrong with a clearance, if anything is."""
    if plan.clearance >= plan.maneuver.margin:
        return ""
    return f"{but}closer than asked" if plan.clearance >= 0 else f": {inside}"
