"""The spec file of a centre of mass, and what of its maneuver and settings does not go together."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Field, model_validator

from ..errors import SpecError
from ..types import Json
from .arm import Arm, ArmManeuver, ArmTask
from .maneuver import Maneuver
from .model import Model
from .reading import load, named, of_kind, read_file
from .settings import MOST_ROWS, GlobalSearch, RefineSearch, Settings, SweepSearch
from .task import Task

MAX_SWEEP_POINTS = 100_000  # ordered obstacle times; above it a sweep would take days
MOST_CERTIFIED = 8  # walls; a box of obstacle times has 2^q corners


def known_version(version: int) -> int:
    """The version of a spec or plan file. Raises `ValueError` for one that is not known."""
    if version != 1:
        raise ValueError("1 (the only version so far)")
    return version


class Spec(Model):
    """A whole spec file of a centre of mass; `ArmSpec` reads those with an arm."""

    kind_of_file: ClassVar[str] = "spec"

    version: Annotated[int, Field(strict=True), AfterValidator(known_version)] = 1
    maneuver: Maneuver
    settings: Settings = Settings()

    @property
    def task(self) -> Maneuver:
        """The maneuver."""
        return self.maneuver

    @model_validator(mode="before")
    @classmethod
    def _is_of_a_point(cls, data: object) -> object:
        if isinstance(data, dict) and "arm" in data:
            raise ValueError(".arm: was given, must be left out here (peakmin.ArmSpec reads spec files with an arm)")
        return data

    @model_validator(mode="after")
    def _fit_together(self) -> Spec:
        try:
            refuse_unfit(self.maneuver, self.settings)
        except SpecError as error:
            raise ValueError(f".{error}") from None
        return self


class ArmSpec(Model):
    """A whole spec file for an arm."""

    version: Annotated[int, Field(strict=True), AfterValidator(known_version)] = 1
    arm: Arm
    maneuver: ArmTask
    settings: Settings = Settings()

    @model_validator(mode="after")
    def _fit_together(self) -> ArmSpec:
        try:
            refuse_unfit(self.task, self.settings)
        except SpecError as error:
            raise ValueError(f".{error}" if not str(error).startswith(".") else str(error)) from None
        return self

    @property
    def task(self) -> ArmManeuver:
        """The task for the arm. Raises `SpecError` where the two do not fit."""
        fields = {name: getattr(self.maneuver, name) for name in ArmTask.model_fields}
        try:
            return ArmManeuver(arm=self.arm, **fields)
        except SpecError as error:
            raise SpecError(f"maneuver.{error}") from None


AnySpec = Spec | ArmSpec


def spec_of(data: Json) -> AnySpec:
    """The spec that a JSON object states, of an arm where it has one. Raises `SpecError` in one line if it is wrong."""
    return ArmSpec(**data) if "arm" in data else Spec(**data)


def read_spec(path: str | Path) -> AnySpec:
    """A spec file, of an arm where it has one. Raises `SpecError` in one line when it cannot be read or is wrong."""
    with named(path):
        data = load(read_file(path))
        of_kind(data, "spec")
        return spec_of(data)


def refuse_other(given: object, kind: type[Task] = Task) -> None:
    """Refuse what is no task, or none of this kind. Raises `SpecError`."""
    _refuse_type("maneuver", given, kind, Maneuver.__name__ if kind is Task else kind.__name__)


def _refuse_type(name: str, given: object, kind: type[Model], wanted: str) -> None:
    if not isinstance(given, kind):
        whole = " (a spec has both: .task, .settings)" if isinstance(given, AnySpec) else ""
        raise SpecError(f"{name}: was a {type(given).__name__}, must be a peakmin.{wanted}{whole}")


def refuse_unfit(task: Task, settings: Settings) -> None:
    """Refuse settings that do not fit the task. Raises `SpecError`."""
    refuse_other(task)
    _refuse_type("settings", settings, Settings, Settings.__name__)
    UNFIT[task.kind](task, settings)


def _refuse_unfit_for_an_arm(_: ArmManeuver, settings: Settings) -> None:
    if settings.search.kind != "global":
        raise SpecError(f"settings.search.kind: was {settings.search.kind!r}, must be 'global' for an arm")


def _refuse_unfit_for_a_point(maneuver: Maneuver, settings: Settings) -> None:
    walls, grid, search = len(maneuver.walls), settings.grid, settings.search
    if not maneuver.simple and not isinstance(search, GlobalSearch):
        what = "blocks" if maneuver.blocks else "a region" if maneuver.region is not None else "a max_speed"
        raise SpecError(f"settings.search.kind: was {search.kind!r}, must be 'global' for a maneuver with {what}")
    if grid.steps < walls + 2:
        raise SpecError(f"settings.grid.steps: was {grid.steps}, must be at least {walls + 2} (walls + 2)")
    if grid.steps * walls > MOST_ROWS:
        most = f"at most {MOST_ROWS // walls} for {walls} walls"
        raise SpecError(f"settings.grid.steps: was {grid.steps}, must be {most}")
    if isinstance(search, GlobalSearch):
        if walls > MOST_CERTIFIED:
            most = f"at most {MOST_CERTIFIED} for a global search"
            raise SpecError(f"maneuver.obstacles: was {walls} walls, must be {most}")
    else:
        _refuse_times(maneuver.duration, walls, search)


UNFIT: dict[str, Callable[[Any, Settings], None]] = {  # by the kind of task
    "point": _refuse_unfit_for_a_point,
    "arm": _refuse_unfit_for_an_arm,
}


def _refuse_times(duration: float, walls: int, search: SweepSearch | RefineSearch) -> None:
    """Refuse a choice of obstacle times that is out of the duration [s], too small or too large."""
    if isinstance(search, SweepSearch):
        start, stop = search.span(duration)
        for name, value in (("start", start), ("stop", stop)):
            if not 0 < value < duration:
                raise SpecError(f"settings.search.{name}: was {value}, must be between 0 and the duration {duration}")
        if start > stop:
            raise SpecError(f"settings.search.start: was {start}, must not be after stop, {stop}")
    if walls > search.count:
        raise SpecError(f"settings.search.count: was {search.count}, must be at least the number of walls, {walls}")
    if math.comb(search.count, walls) > MAX_SWEEP_POINTS:
        raise SpecError(
            f"maneuver.obstacles: was {walls} walls, must be fewer for {search.count} obstacle times "
            f"(at most {MAX_SWEEP_POINTS} ordered choices)"
        )


def schema() -> Json:
    """The JSON Schema of a spec file."""
    return Spec.model_json_schema()
