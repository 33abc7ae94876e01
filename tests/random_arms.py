"""Seeded tasks of arms: two links with same and different elbows; any number of links with limits, among blocks."""

import numpy as np

import peakmin as pm
from peakmin.scenes.kinds import TIMES, allowed

TASKS = 120


def task(seed: int) -> pm.ArmManeuver | None:
    """The task, or None where the arm touches the table at an end."""
    rng = np.random.default_rng(seed)
    links = [pm.Link(length=rng.uniform(0.7, 1.3), mass=rng.uniform(0.5, 2)) for _ in range(2)]
    arm = pm.Arm(links=links, payload=float(rng.choice([0, 0.5])))
    longest, apart = sum(link.length for link in links), abs(links[0].length - links[1].length)

    def pose(elbow):
        rho, angle = rng.uniform(apart + 0.2 * longest, 0.95 * longest), rng.uniform(-1.6, 1.6)
        return pm.Pose(tip=(rho * np.cos(angle), rho * np.sin(angle)), elbow=elbow)

    same, first = rng.random() < 0.6, str(rng.choice(["up", "down"]))
    other = {"up": "down", "down": "up"}[first]
    table = []
    if rng.random() < 0.6:
        x, y = rng.uniform(0.6, 1.6), rng.uniform(-1.0, 0.6)
        w, h = rng.uniform(0.2, 0.6), rng.uniform(0.1, 0.4)
        table = [pm.Block(vertices=[(x, y), (x + w, y), (x + w, y + h), (x, y + h)])]
    ends = {"start": pose(first), "goal": pose(first if same else other)}
    duration = float(rng.uniform(1, 4))
    try:
        return pm.ArmManeuver(arm=arm, **ends, duration=duration, obstacles=table)
    except pm.SpecError:
        return None


def limited(seed: int, n: int) -> pm.ArmManeuver:
    """A task of n links with joint limits, speeds and torques, among none to two blocks.

    Speeds and torques are 1.2 to 3 times what the straight motion of the joints needs.
    """
    rng = np.random.default_rng([seed, n])
    for _ in range(1000):
        length = rng.uniform(0.5, 1.0, n) * 2 / n
        mass = np.sort(rng.uniform(0.5, 5.0, n))[::-1]
        low, high = rng.uniform(-2.8, -1.0, n), rng.uniform(1.0, 2.8, n)
        low[0], high[0] = low[0] - 1, high[0] + 1
        start, goal = (low + (high - low) * rng.uniform(0.1, 0.9, n) for _ in range(2))
        bare = [pm.Link(length=a, mass=m, half_width=0.02) for a, m in zip(length, mass, strict=True)]
        T = float(rng.uniform(1, 4))
        ends = {"start": pm.Pose(joints=tuple(start)), "goal": pm.Pose(joints=tuple(goal)), "duration": T}
        payload = float(rng.choice([0.0, 1.0]))
        free = pm.ArmManeuver(arm=pm.Arm(links=bare, payload=payload), **ends)
        need = allowed(free, start, goal)
        room = rng.uniform(1.2, 3.0, (2, n)) / TIMES
        links = [
            link.model_copy(
                update={"limits": (low[k], high[k]), "max_speed": need.speed[k] * room[0, k], "max_torque": torque}
            )
            for k, (link, torque) in enumerate(zip(bare, need.torque * room[1], strict=True))
        ]
        blocks = [_block(rng, free.arm.chain.size) for _ in range(rng.integers(0, 3))]
        try:
            arm = pm.Arm(links=[pm.Link(**link.model_dump()) for link in links], payload=payload)
            return pm.ArmManeuver(arm=arm, **ends, obstacles=blocks, margin=0.01)
        except pm.SpecError:
            continue
    raise AssertionError("no task")


def _block(rng: np.random.Generator, size: float) -> pm.Block:
    """A box somewhere within reach."""
    far, angle = rng.uniform(0.35, 1.0) * size, rng.uniform(-np.pi, np.pi)
    w, h, turn = *rng.uniform(0.1, 0.35, 2) * size, rng.uniform(0, np.pi)
    corners = np.array([(-w, -h), (w, -h), (w, h), (-w, h)]) / 2
    c, s = np.cos(turn), np.sin(turn)
    placed = corners @ np.array([[c, s], [-s, c]]) + far * np.array([np.cos(angle), np.sin(angle)])
    return pm.Block(vertices=[tuple(p) for p in placed.tolist()])
