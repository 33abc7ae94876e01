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


def ipopt(holds, start):
    """The paper's problem as two phases of `holds` holds with the obstacle time free: a local minimum by IPOPT."""
    import casadi as ca

    problem = ca.Opti()
    peak, split = problem.variable(), problem.variable()
    controls = problem.variable(2, 2 * holds)
    position, velocity = ca.DM([0, 0]), ca.DM([0, 0])
    for k in range(2 * holds):
        step = (split if k < holds else 1 - split) / holds
        u = controls[:, k]
        position, velocity = position + step * velocity + step**2 / 2 * u, velocity + step * u
        problem.subject_to(ca.sumsqr(u) <= peak**2)
        if k % holds == holds - 1:  # states where the phases meet, or the graph grows with the holds' square
            place, speed = problem.variable(2), problem.variable(2)
            problem.subject_to(place == position)
            problem.subject_to(speed == velocity)
            position, velocity = place, speed
            problem.subject_to(position == ca.DM([0.5, 0.5] if k < holds else [1, 0]))
    problem.subject_to(velocity == 0)
    problem.subject_to(problem.bounded(0.01, split, 0.99))
    problem.subject_to(peak >= 0)
    problem.minimize(peak)
    problem.set_initial(split, start)
    problem.set_initial(peak, 15)
    problem.set_initial(controls, 1)
    problem.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    return float(problem.solve().value(peak))
