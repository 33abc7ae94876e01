"""Frozen pydantic models whose refusals are one line: field path, what it was, what it must be."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from ..errors import SpecError
from .reading import load, named, of_kind, read_file
from .refusal import one_line, plain

LARGEST = 1e100  # of any number in a spec, in SI units: squares and products stay finite
FASTEST = 1e90  # m/s^2, of a maneuver's own size: what comes of it stays below LARGEST


def _within(value: float) -> float:
    if abs(value) > LARGEST:
        raise ValueError(f"a number of at most {LARGEST:g} in size")
    return value if abs(value) >= 1 / LARGEST else 0.0


def in_reach(places: Sequence[Sequence[float]], duration: float) -> None:
    """Refuse (ValueError, worded for a spec) places [m] so far away that a plan's numbers are too large for a file."""
    far = max(abs(x) for place in places for x in place)
    if far > FASTEST * duration**2:
        raise ValueError(f".duration: was {duration}, must be longer for a way of {far:g} m")


def _positive(value: float) -> float:
    if not 1 / LARGEST <= value <= LARGEST:
        raise ValueError(f"a number above zero (from {1 / LARGEST:g} to {LARGEST:g})")
    return value


_Finite = Annotated[float, Field(strict=True), BeforeValidator(plain)]
Number = Annotated[_Finite, AfterValidator(_within)]
Positive = Annotated[_Finite, AfterValidator(_positive)]
Switch = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000), BeforeValidator(plain)]


def few(most: int) -> BeforeValidator:
    """Refuses a list of more than `most` entries before any of them is looked at."""

    def check(value: object) -> object:
        if isinstance(value, list | tuple) and len(value) > most:
            raise ValueError(f"a list of at most {most}")
        return value

    return BeforeValidator(check)


Vector = Annotated[tuple[Number, Number], BeforeValidator(plain)]


class Model(BaseModel):
    """Frozen, keyword-only, unknown keys refused, no NaN, no infinity.

    Raises:
        SpecError: on construction, when a field is wrong.
    """

    kind_of_file: ClassVar[str] = ""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)

    def __init__(self, **data: object) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise SpecError(one_line(error, data)) from None

    # Without this mark pydantic would call __init__ for nested models too and lose the outer path.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def from_json(cls, text: str | bytes) -> Self:
        """Read one JSON document. Raises `SpecError` with one line when it is not a valid one."""
        return cls(**load(text))

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a JSON file. Raises `SpecError` with one line when it cannot be read or is wrong."""
        with named(path):
            data = load(read_file(path))
            if cls.kind_of_file:
                of_kind(data, cls.kind_of_file)
            return cls(**data)

    def to_json(self, indent: int | None = 2) -> str:
        """The model as JSON; `from_json` gives an equal one back."""
        return self.model_dump_json(indent=indent, exclude_none=True)
