"""Base force, base moment and joint torques of a planar arm without gravity, by inverse dynamics.

With the centre of link m at r_m and inertia I_m about it, the joint k must exert on what lies beyond it

    tau_k = sum_{m>=k} ( I_m theta_m'' + (r_m - joint_k) x m_m r_m'' )  + the payload's  (tip - joint_k) x payload tip''

tau_1 is the base moment, and the base force is  sum m_m r_m'' = m u  whatever the inertias.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from .joints import JointPath
from .kinematics import unit


def torques(path: JointPath, t: ArrayLike) -> Array:
    """tau [N m] at t [s], shape (...) -> (..., n); at a node those of the hold that begins there."""
    chain = path.chain
    theta, first, second = path.rates(t)
    along = unit(theta)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    turned = second[..., None] * across - first[..., None] ** 2 * along  # e''
    joints, accelerations = chain.joints(theta), np.cumsum(chain.length[:, None] * turned, axis=-2)
    accelerations = np.concatenate([np.zeros_like(accelerations[..., :1, :]), accelerations], axis=-2)
    places = joints[..., :-1, :] + chain.com[:, None] * along
    forces = chain.mass[:, None] * (accelerations[..., :-1, :] + chain.com[:, None] * turned)
    out = np.zeros_like(theta)
    for k in range(chain.links):
        arm = places[..., k:, :] - joints[..., k : k + 1, :]
        load = forces[..., k:, :]
        moments = chain.inertia[k:] * second[..., k:] + arm[..., 0] * load[..., 1] - arm[..., 1] * load[..., 0]
        tip, last = joints[..., -1, :] - joints[..., k, :], chain.payload * accelerations[..., -1, :]
        out[..., k] = np.sum(moments, axis=-1) + tip[..., 0] * last[..., 1] - tip[..., 1] * last[..., 0]
    return out


def base_moment(path: JointPath, t: ArrayLike) -> Array:
    """Moment about the first joint that the base exerts on the arm [N m], shape (...)."""
    return np.asarray(torques(path, t)[..., 0])
