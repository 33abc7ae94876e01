"""The planned motion in an independent multibody simulation, MuJoCo without gravity: what does the base feel?

The arm is built from the same spec: hinges, rods, payload, on a base with a force sensor. It is driven forward in time
by the planned joint torques alone; how far it drifts from the planned angles says whether they are right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import PeakminError
from ..geometry.norm import norm
from ..plan.arm_plan import ArmPlan
from ..robots.kinematics import Chain
from ..types import Array

STEPS = 20_000  # of the simulation
PEAK_WITHIN, CURVE_WITHIN = 0.005, 0.01
REACH = 1e-6  # of the arm


@dataclass(frozen=True)
class Simulation:
    """What the sensor at the base showed.

    times [s] (m,); planned, felt: base force [N] (m, 2);  drift: largest error of a joint angle [rad].
    """

    times: Array
    planned: Array
    felt: Array
    drift: float

    @property
    def planned_peak(self) -> float:
        """Largest planned base force [N]."""
        return float(np.max(norm(self.planned)))

    @property
    def felt_peak(self) -> float:
        """Largest simulated base force [N]."""
        return float(np.max(norm(self.felt)))

    @property
    def agrees(self) -> bool:
        """Whether the peak is the planned one to 0.5 % and the curve to 1 % of the peak."""
        near = abs(self.felt_peak - self.planned_peak) <= PEAK_WITHIN * self.planned_peak
        return near and self.error <= CURVE_WITHIN

    @property
    def error(self) -> float:
        """Largest difference of the two curves, as a share of the planned peak."""
        return float(np.max(norm(self.felt - self.planned))) / (self.planned_peak or 1.0)


def model_text(chain: Chain) -> str:
    """The arm in MuJoCo's XML format."""
    nested, closing = "", ""
    for k in range(chain.links):
        at = f"{chain.length[k - 1]:.17g} 0 0" if k else "0 0 0"
        inertia = f"{chain.inertia[k]:.17g}"
        nested += (
            f'<body name="link{k + 1}" pos="{at}"><joint name="joint{k + 1}" type="hinge" axis="0 0 1"/>'
            f'<inertial pos="{chain.com[k]:.17g} 0 0" mass="{chain.mass[k]:.17g}" '
            f'diaginertia="{inertia} {inertia} {inertia}"/>'
        )
        closing += "</body>"
    if chain.payload > 0:
        tiny = f"{1e-9 * chain.payload * float(np.sum(chain.length)) ** 2:.3g}"
        nested += (
            f'<body name="payload" pos="{chain.length[-1]:.17g} 0 0"><inertial pos="0 0 0" '
            f'mass="{chain.payload:.17g}" diaginertia="{tiny} {tiny} {tiny}"/></body>'
        )
    motors = "".join(f'<motor joint="joint{k + 1}"/>' for k in range(chain.links))
    return (
        '<mujoco><compiler angle="radian" balanceinertia="true"/><option gravity="0 0 0" integrator="RK4"/>'
        f'<worldbody><body name="base" pos="{chain.base[0]:.17g} {chain.base[1]:.17g} 0">'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="base"/>'
        f"{nested}{closing}</body></worldbody><actuator>{motors}</actuator>"
        '<sensor><force name="base" site="base"/></sensor></mujoco>'
    )


def simulate(plan: ArmPlan, steps: int = STEPS) -> Simulation:
    """Drive the simulated arm along a plan and read the force at its base.

    Raises:
        PeakminError: without MuJoCo (the `sim` extra), or where the plan has no motion.
    """
    try:
        import mujoco
    except ImportError:
        raise PeakminError("simulate: needs MuJoCo, must be installed with the `sim` extra (peakmin[sim])") from None
    if plan.joints is None:
        raise PeakminError(f"simulate: was a plan that is {plan.status}, must have a motion")
    if plan.clear is not None and (plan.clear.within < -REACH * plan.joints.chain.reach[1] or not plan.clear.steady):
        raise PeakminError(
            "simulate: was a plan whose path leaves what is in reach, must be one that the arm can follow"
        )
    chain, path = plan.joints.chain, plan.joints
    model = mujoco.MjModel.from_xml_string(model_text(chain))
    data = mujoco.MjData(model)
    h = plan.maneuver.duration / steps
    model.opt.timestep = h
    # torques in the middle of a step: none of them is averaged over a switch when switches are at steps' ends
    t: Array = h * np.arange(steps, dtype=float)
    theta = path.absolute(t + h / 2)
    wanted = np.diff(theta, axis=-1, prepend=0.0)
    with np.errstate(all="ignore"):
        load = plan.torques(t + h / 2)
    if not np.all(np.isfinite(load)):
        raise PeakminError("simulate: was a plan whose joints need torques without end, must have finite ones")
    planned = plan.base_force(t + h / 2)
    data.qpos[:] = path.angles(0.0)
    data.qvel[:] = np.diff(path.rates(0.0)[1], prepend=0.0)
    felt: Array = np.empty((steps, 2))
    drift = 0.0
    for k in range(steps):
        data.ctrl[:] = load[k]
        drift = max(drift, float(np.max(np.abs(wanted[k] - data.qpos - h / 2 * data.qvel))))
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)  # the sensor with this step's torques at the state they led to
        felt[k] = data.sensordata[:2]
    return Simulation(t + h / 2, planned, felt, drift)
