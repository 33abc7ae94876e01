"""Seeded random maneuvers, easy and degenerate, for the tests of the proofs."""

import numpy as np

import peakmin as pm


def maneuver(seed, walls=None):
    """One of them: 1 to 3 walls, touch and clear, any direction, at rest or moving; every fourth is degenerate."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4)) if walls is None else walls
    while True:
        start, goal = rng.normal(size=(2, 2))
        velocities = rng.normal(size=(2, 2)) * 10.0 ** rng.uniform(-2, 1, (2, 1)) * (rng.random((2, 1)) < 0.6)
        tips = rng.normal(size=(count, 2))
        if seed % 4 == 3:  # tips on the straight line, walls along it, start on a wall's line
            tips[0] = start + rng.choice([0.0, 0.5, 1.0]) * (goal - start)
            tips[-1] = np.round(tips[-1])
        directions = rng.normal(size=(count, 2)) if seed % 2 else [(0, rng.choice([-1.0, 1.0])) for _ in tips]
        obstacles = [
            pm.Wall(tip=tuple(tip), direction=tuple(direction), contact=str(rng.choice(["touch", "clear"])))
            for tip, direction in zip(tips, directions, strict=True)
        ]
        try:
            return pm.Maneuver(
                start=pm.State(position=tuple(start), velocity=tuple(velocities[0])),
                goal=pm.State(position=tuple(goal), velocity=tuple(velocities[1])),
                duration=float(10.0 ** rng.uniform(-1, 1)),
                obstacles=obstacles,
            )
        except pm.SpecError:  # listed against the way: draw again
            continue


def times(seed, walls):
    """Obstacle times in (0, 1), some of them close to an end or to each other."""
    rng = np.random.default_rng(10_000 + seed)
    return np.sort(rng.uniform(0.02, 0.98, walls)) if seed % 5 else np.sort(rng.uniform(0.01, 0.99, walls) ** 3)
