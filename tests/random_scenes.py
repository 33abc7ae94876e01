"""Seeded random scenes of one to four blocks for the tests of the ways past them."""

import numpy as np
import shapely

import peakmin as pm


def polygon(rng, centre, size):
    """A star-shaped polygon, convex or not."""
    corners = int(rng.integers(3, 8))
    angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
    radii = size * rng.uniform(0.4, 1.0, corners)
    return centre + radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def scene(seed):
    """A maneuver turned and displaced at random; every third moves at its ends, every fifth has a margin."""
    rng = np.random.default_rng(50_000 + seed)
    turn, origin = rng.uniform(0, 2 * np.pi), rng.normal(size=2) * 10.0 ** rng.uniform(-1, 1)
    scale = 10.0 ** rng.uniform(-1, 1)
    axes = scale * np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    margin = float(scale * rng.uniform(0.01, 0.05)) if seed % 5 == 0 else 0.0
    velocities = rng.normal(size=(2, 2)) * scale * (1.5 if seed % 3 == 0 else 0.0)
    while True:
        blocks = []
        for _ in range(int(rng.integers(1, 5))):
            centre = np.array([rng.uniform(0.1, 0.9), rng.normal() * 0.2])
            corners = origin + polygon(rng, centre, rng.uniform(0.05, 0.25)) @ axes
            side = str(rng.choice(["left", "right", "either", "either"]))
            blocks.append({"kind": "block", "vertices": corners.tolist(), "side": side})
        shapes = [shapely.Polygon(block["vertices"]) for block in blocks]
        if any(a.distance(b) < 2.5 * margin + 0.02 * scale for i, a in enumerate(shapes) for b in shapes[:i]):
            continue
        try:
            return pm.Maneuver(
                start=pm.State(position=origin, velocity=velocities[0]),
                goal=pm.State(position=origin + axes[0], velocity=velocities[1]),
                duration=float(10.0 ** rng.uniform(-0.5, 0.5)),
                obstacles=blocks,
                margin=margin,
            )
        except pm.SpecError:  # a block around an end, or edges that cross
            continue
