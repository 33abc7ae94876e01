"""A task for an arm: the configurations that its poses allow, checked to exist and to stand free; the spec file."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from ..errors import SpecError
from ..robots.kinematics import Pair
from ..robots.workspace import Workspace
from .arm import Arm, Pose, Task
from .model import Model
from .settings import GlobalSearch, Settings
from .spec import known_version

ANGLE = 1e-9  # rad: up to which a joint counts as within its limits


class ArmManeuver(Task):
    """A task for an arm."""

    arm: Arm

    @model_validator(mode="after")
    def _poses_exist(self) -> ArmManeuver:
        for name, pose in (("start", self.start), ("goal", self.goal)):
            try:
                found = postures(self.arm, pose)
            except ValueError as error:
                raise ValueError(f".{name}{error}") from None
            if not found:
                first, second = (link.length for link in self.arm.links[:2])
                assert pose.tip is not None
                raise ValueError(
                    f".{name}.tip: was {list(pose.tip)}, must be {abs(first - second):g} to {first + second:g} m "
                    f"from the base, {list(self.arm.base)}"
                )
            beyond = [_beyond(self.arm, pose, theta, exact=name == "start") for theta in found]
            if None not in beyond:
                raise ValueError(f".{name}.{beyond[0]}")
            hits = [hit_by(self, theta) for theta in found]
            if None not in hits:
                i, link, depth = next(hit for hit in hits if hit is not None)
                raise ValueError(
                    f".obstacles[{i}]: was {depth:.4g} m from link {link + 1} at the {name}, must leave the arm "
                    f"{self.margin:g} m free there"
                )
        return self


def postures(arm: Arm, pose: Pose) -> list[tuple[float, ...]]:
    """The absolute angles [rad] of every configuration that a pose allows, best known order: up, down.

    Raises:
        ValueError: where the pose does not fit the arm, worded for a spec.
    """
    if pose.joints is not None:
        if len(pose.joints) != len(arm.links):
            raise ValueError(f".joints: was {len(pose.joints)} angles, must be {len(arm.links)}, one for every link")
        return [tuple(np.cumsum(pose.joints).tolist())]
    if len(arm.links) != 2:
        raise ValueError(f".tip: was given for {len(arm.links)} links, must be joints (a tip needs two links)")
    assert pose.tip is not None
    pair = Pair(arm.links[0].length, arm.links[1].length)
    s = np.array(pose.tip) - arm.base
    rho, room = math.hypot(*s), 1e-12 * pair.outer
    if not pair.inner - room <= rho <= pair.outer + room:
        return []
    signs = {"up": [-1.0], "down": [1.0]}.get(pose.elbow or "either", [-1.0, 1.0])
    return [tuple(pair.angles(s, sign).tolist()) for sign in signs]


def _beyond(arm: Arm, pose: Pose, theta: tuple[float, ...], exact: bool) -> str | None:
    """A joint of a configuration that is outside of its limits, worded for a spec; or None.

    Args:
        exact: whether a pose given as joints has these very angles, else they are meant up to full turns.
    """
    for k, (link, q) in enumerate(zip(arm.links, pose.joints or np.diff(theta, prepend=0.0).tolist(), strict=True)):
        if link.limits is None:
            continue
        low, high = link.limits[0] - ANGLE, link.limits[1] + ANGLE
        near = q if exact and pose.joints else q + math.tau * math.ceil((low - q) / math.tau)
        if not low <= near <= high:
            what = f"joints[{k}]: was {q:g}" if pose.joints else f"tip: was {list(pose.tip or ())}, joint {k + 1} {q:g}"
            return f"{what} rad, must be within arm.links[{k}].limits, {list(link.limits)}"
    return None


def hit_by(maneuver: ArmManeuver, theta: tuple[float, ...]) -> tuple[int, int, float] | None:
    """An obstacle nearer than the margin in a configuration: its index, the link's, their distance [m]; or None."""
    return Workspace(maneuver).touched(np.array(theta))


class ArmSpec(Model):
    """A whole spec file for an arm."""

    version: Annotated[int, Field(strict=True), AfterValidator(known_version)] = 1
    arm: Arm
    maneuver: Task
    settings: Settings = Settings()

    @model_validator(mode="after")
    def _fit_together(self) -> ArmSpec:
        try:
            check_arm(self.asked, self.settings)
        except SpecError as error:
            raise ValueError(f".{error}" if not str(error).startswith(".") else str(error)) from None
        return self

    @property
    def asked(self) -> ArmManeuver:
        """The task for the arm. Raises `SpecError` where the two do not fit."""
        fields = {name: getattr(self.maneuver, name) for name in Task.model_fields}
        try:
            return ArmManeuver(arm=self.arm, **fields)
        except SpecError as error:
            raise SpecError(f"maneuver.{error}") from None


def check_arm(maneuver: ArmManeuver, settings: Settings) -> None:
    """Refuse settings that do not fit. Raises `SpecError`."""
    if not isinstance(settings.search, GlobalSearch):
        raise SpecError(f"settings.search.kind: was {settings.search.kind!r}, must be 'global' for an arm")
