"""An arm's motion of least peak as one would write it: multiple shooting, separating lines, IPOPT from many starts."""

import time

import numpy as np

import peakmin as pm
from peakmin.robots.joint_motion import JointMotion
from peakmin.robots.separation import convex_pieces

HOLDS = 40
BENT = 1.2  # rad: how far starts are bent from the straight motion of the joints
KEPT = 1e-3  # of what is asked: up to which a motion counts as keeping it


class Ipopt:
    """Joint accelerations held on N holds; what is asked holds at both ends and the middle of every hold."""

    def __init__(self, task, goal):
        import casadi as ca

        self.task, chain = task, task.arm.chain
        n, N, h, w = chain.links, HOLDS, task.duration / HOLDS, task.arm.links
        self.problem = problem = ca.Opti()
        self.q, self.v, self.a = (problem.variable(n, N + k) for k in (1, 1, 0))
        self.peak = problem.variable()
        start = np.array(task.start.joints)
        q, v, a = self.q, self.v, self.a
        for x, value in ((q[:, 0], start), (v[:, 0], 0), (q[:, N], goal), (v[:, N], 0)):
            problem.subject_to(x == value)
        problem.subject_to(q[:, 1:] == q[:, :-1] + h * v[:, :-1] + h**2 / 2 * a)
        problem.subject_to(v[:, 1:] == v[:, :-1] + h * a)
        for k, link in enumerate(w):
            problem.subject_to(problem.bounded(link.limits[0], q[k, :], link.limits[1]))
            problem.subject_to(problem.bounded(-link.max_speed, v[k, :], link.max_speed))
        pieces = [piece for block in task.obstacles for piece in convex_pieces(np.array(block.vertices))]
        self.lines = [problem.variable(n, N) for _ in pieces]
        for i in range(N):
            for share in (0, 0.5, 1):
                s = share * h
                at = (q[:, i] + s * v[:, i] + s**2 / 2 * a[:, i], v[:, i] + s * a[:, i], a[:, i])
                u, tau, joints = dynamics(ca, chain, *at)
                problem.subject_to(ca.sumsqr(u) <= self.peak**2)
                for k, link in enumerate(w):
                    problem.subject_to(problem.bounded(-link.max_torque, tau[k], link.max_torque))
                if share == 0.5:
                    for piece, line in zip(pieces, self.lines, strict=True):
                        for k in range(n):
                            g = ca.vertcat(ca.cos(line[k, i]), ca.sin(line[k, i]))
                            beyond = ca.mmax(ca.mtimes(piece, g)) + task.margin + chain.half_width[k]
                            for end in (joints[k], joints[k + 1]):
                                problem.subject_to(ca.dot(g, end) >= beyond)
        problem.subject_to(self.peak >= 0)
        problem.minimize(self.peak)
        self.pieces = pieces

    def best(self, begin, rng, seconds):
        """A motion from one start, or None; JointMotion."""
        problem, task = self.problem, self.task
        chain, n = task.arm.chain, task.arm.chain.links
        s = np.linspace(0, 1, HOLDS + 1)
        way = begin + (10 * s**3 - 15 * s**4 + 6 * s**5)[:, None] * (self.goal(begin) - begin)
        if rng is not None:
            way = way + np.sin(np.pi * s)[:, None] * rng.normal(size=n) * BENT
        problem.set_initial(self.q, way.T)
        problem.set_initial(self.v, np.gradient(way, task.duration / HOLDS, axis=0).T)
        problem.set_initial(self.peak, 1.0)
        theta = np.cumsum(way, axis=1)
        middle = (theta[:-1] + theta[1:]) / 2
        places = chain.joints(middle)
        for piece, line in zip(self.pieces, self.lines, strict=True):
            towards = (places[:, :-1] + places[:, 1:]) / 2 - piece.mean(axis=0)
            problem.set_initial(line, np.arctan2(towards[..., 1], towards[..., 0]).T)
        options = {"print_level": 0, "sb": "yes", "max_cpu_time": max(seconds, 0.1), "max_iter": 3000}
        problem.solver("ipopt", {"print_time": False, "error_on_fail": False}, options)
        try:
            found = problem.solve_limited()
        except RuntimeError:
            return None
        held = np.array(found.value(self.a)).reshape(n, HOLDS).T
        return JointMotion(chain, np.linspace(0, task.duration, HOLDS + 1), held, begin)

    def goal(self, begin):
        return np.array(self.task.goal.joints)


def dynamics(ca, chain, q, v, a):
    """u, tau and the places of the joints, symbolic."""
    n = chain.links
    theta, w, b = (ca.cumsum(x) for x in (q, v, a))
    place, gained = [ca.DM(chain.base)], [ca.DM.zeros(2)]
    u, middles, forces = ca.DM.zeros(2), [], []
    for k in range(n):
        along = ca.vertcat(ca.cos(theta[k]), ca.sin(theta[k]))
        across = ca.vertcat(-along[1], along[0])
        bent = b[k] * across - w[k] ** 2 * along
        u += chain.c[k] * bent
        middles.append(place[-1] + chain.com[k] * along)
        forces.append(chain.mass[k] * (gained[-1] + chain.com[k] * bent))
        place.append(place[-1] + chain.length[k] * along)
        gained.append(gained[-1] + chain.length[k] * bent)
    tau = []
    for k in range(n):
        total = 0
        for m in range(k, n):
            arm = middles[m] - place[k]
            total += chain.inertia[m] * b[m] + arm[0] * forces[m][1] - arm[1] * forces[m][0]
        arm = place[-1] - place[k]
        total += chain.payload * (arm[0] * gained[-1][1] - arm[1] * gained[-1][0])
        tau.append(total)
    return u, tau, place


def ipopt(task, starts=10, seconds=60.0, seed=0):
    """The least peak [m/s^2] of motions that keep what is asked at 10,000 instants, and the seconds it took."""
    began, rng, best = time.perf_counter(), np.random.default_rng(seed), np.inf
    begin = np.array(task.start.joints)
    peer = Ipopt(task, np.array(task.goal.joints))
    for k in range(starts):
        left = seconds - (time.perf_counter() - began)
        if left <= 0:
            break
        motion = peer.best(begin, rng if k else None, left)
        if motion is not None and sampled(task, motion)[0] <= KEPT:
            best = min(best, sampled(task, motion)[1])
    return best, time.perf_counter() - began


def sampled(task, motion, instants=10_000):
    """At instants: what is not kept, each relative to what it is asked of, and the largest |u| [m/s^2]."""
    t = np.linspace(0, task.duration, instants)
    q = motion.angles(t)
    theta, first, second = motion.rates(t)
    speed = np.diff(first, axis=-1, prepend=0.0)
    tau = pm.robots.dynamics.inverse_dynamics(task.arm.chain, theta, first, second)
    short = [0.0]
    for k, link in enumerate(task.arm.links):
        short += [np.max(link.limits[0] - q[:, k]), np.max(q[:, k] - link.limits[1])]
        short += [np.max(np.abs(speed[:, k])) / link.max_speed - 1, np.max(np.abs(tau[:, k])) / link.max_torque - 1]
    if task.obstacles:
        workspace = task.workspace
        short.append((task.margin - np.min(workspace.clearance(theta))) / workspace.size)
    goal = np.array(task.goal.joints)
    short += [np.max(np.abs(q[-1] - goal)), np.max(np.abs(speed[-1])) * task.duration]
    return max(short), float(np.max(np.hypot(*motion.motion.acceleration(t).T)))
