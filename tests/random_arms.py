"""Seeded two-link tasks: same and different elbows, with and without a table."""

import numpy as np

import peakmin as pm

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
