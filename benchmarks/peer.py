"""The paper's loop as one would write it: states as variables, matrices rebuilt at every step, scipy's HiGHS."""

import numpy as np
from scipy import sparse
from scipy.optimize import linprog


def sweep(nodes, steps, dt, normals, inradius, wall, goal, upper, tolerance):
    """Upper bisection ends at each obstacle node; the paper's general problem."""
    return [bisect(node, steps, dt, normals, inradius, wall, goal, upper, tolerance) for node in nodes]


def bisect(node, steps, dt, normals, inradius, wall, goal, upper, tolerance):
    left, right = 0.0, upper
    while not feasible(node, steps, dt, normals, inradius, wall, goal, right):
        left, right = right, 2 * right
    while right - left > tolerance:
        middle = (left + right) / 2
        if feasible(node, steps, dt, normals, inradius, wall, goal, middle):
            right = middle
        else:
            left = middle
    return right


def feasible(node, steps, dt, normals, inradius, wall, goal, peak):
    states = 2 * (steps + 1)  # per axis: position and velocity at every node
    phi, gamma = np.array([[1, dt], [0, 1]]), np.array([[dt * dt / 2], [dt]])
    forward = sparse.kron(sparse.eye(steps, steps + 1, 1), np.eye(2)) - sparse.kron(sparse.eye(steps, steps + 1), phi)
    control = -sparse.kron(sparse.eye(steps), gamma)
    dynamics = sparse.bmat([[forward, None, control, None], [None, forward, None, control]])
    fixed = [(0, 0), (1, 0), (states, 0), (states + 1, 0), (states - 2, goal[0]), (states - 1, 0)]
    fixed += [(2 * states - 2, goal[1]), (2 * states - 1, 0), (2 * node, wall[0]), (states + 2 * node, wall[1])]
    ends = sparse.csr_matrix(
        (np.ones(len(fixed)), (range(len(fixed)), [i for i, _ in fixed])), (len(fixed), dynamics.shape[1])
    )
    equations = sparse.vstack([dynamics, ends]).tocsc()
    values = np.concatenate([np.zeros(dynamics.shape[0]), [v for _, v in fixed]])
    circle = sparse.hstack(
        [
            sparse.csr_matrix((steps * len(normals), 2 * states)),
            sparse.kron(sparse.eye(steps), normals[:, :1]),
            sparse.kron(sparse.eye(steps), normals[:, 1:]),
        ]
    )
    limits = np.full(steps * len(normals), peak * inradius)
    cost = np.zeros(dynamics.shape[1])
    return linprog(cost, circle, limits, equations, values, (None, None), method="highs").status == 0
