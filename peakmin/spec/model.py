"""Frozen pydantic models whose refusals are one line: field path, what it was, what it must be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from ..errors import SpecError
from .reading import WHOLE, load, named, of_kind, read_file, short

LARGEST = 1e100  # of any number in a spec, in SI units: squares and products stay finite
FASTEST = 1e90  # m/s^2, of a maneuver's own size: what comes of it stays below LARGEST
PLAIN = {  # pydantic's error types in the words of a spec file
    "float_type": "a number",
    "int_type": "a whole number",
    "tuple_type": "a list",
    "model_type": "an object",
    "model_attributes_type": "an object",
}


def _plain(value: object) -> object:
    """Arrays and numpy scalars as lists and numbers."""
    return value.tolist() if hasattr(value, "tolist") else value


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


_Finite = Annotated[float, Field(strict=True), BeforeValidator(_plain)]
Number = Annotated[_Finite, AfterValidator(_within)]
Positive = Annotated[_Finite, AfterValidator(_positive)]
Switch = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000), BeforeValidator(_plain)]


def few(most: int) -> BeforeValidator:
    """Refuses a list of more than `most` entries before any of them is looked at."""

    def check(value: object) -> object:
        if isinstance(value, list | tuple) and len(value) > most:
            raise ValueError(f"a list of at most {most}")
        return value

    return BeforeValidator(check)


Vector = Annotated[tuple[Number, Number], BeforeValidator(_plain)]


class Model(BaseModel):
    """Frozen, keyword-only, unknown keys refused, no NaN, no infinity.

    Raises:
        SpecError: on construction, when a field is wrong.
    """

    kind_of_file: ClassVar[str] = ""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)

    def __init__(self, **data: Any) -> None:
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


def one_line(error: ValidationError, data: Any) -> str:
    """The first of pydantic's findings as `path: was X, must be Y`."""
    found = error.errors(include_url=False)
    # Of a value that fits no member of a union, the deepest finding says most.
    first = max(found, key=lambda item: len(item["loc"])) if _is_union(found) else found[0]
    path = _path(first["loc"], data, first["type"] == "missing")
    message = first["msg"]
    if first["type"] == "missing":
        own = [item["loc"] for item in found if item["type"] == "extra_forbidden"]
        others = [short(place[-1]) for place in own if place[:-1] == first["loc"][:-1]]
        unknown = f" ({', '.join(others)}: no such field)" if 0 < len(others) <= 3 else ""
        return f"{path}: was missing, must be given{unknown}"
    if first["type"] == "extra_forbidden":
        return f"{path}: was {short(first['input'])}, must be left out (no such field{_of_kind(first['loc'], data)})"
    if first["type"].startswith("union_tag"):
        if first["type"] == "union_tag_not_found":
            return f"{path}.kind: was missing, must be given"
        tags = first.get("ctx", {}).get("expected_tags", "")
        kind = first["input"].get("kind") if isinstance(first["input"], Mapping) else first["input"]
        return f"{path}.kind: was {short(kind)}, must be one of {tags or 'the known kinds'}"
    if first["type"] == "value_error":
        message = str(first.get("ctx", {}).get("error", message))
        if message.startswith("."):  # a validator of several fields names the one at fault itself
            return (("" if path == WHOLE else path) + message).removeprefix(".")
        return f"{path}: was {short(first['input'])}, must be {message}"
    if first["type"] == "too_short":
        return f"{path}: was {short(first['input'])}, must be a list of at least {first['ctx']['min_length']}"
    if first["type"] == "too_long":
        most = first["ctx"]["max_length"]
        wanted = "two numbers" if most == 2 else f"at most {most}"
        return f"{path}: was {short(first['input'])}, must be a list of {wanted}"
    if first["type"] in PLAIN:
        return f"{path}: was {short(first['input'])}, must be {PLAIN[first['type']]}"
    for start in ("Input should be ", "Value error, ", "String should ", "Tuple should "):
        message = message.removeprefix(start)
    return f"{path}: was {short(first['input'])}, must be {message}"


def _is_union(found: Sequence[ErrorDetails]) -> bool:
    return len(found) > 1 and len({item["loc"][:1] for item in found}) == 1


def _path(location: Sequence[int | str], data: Any, absent: bool) -> str:
    """The location as the user wrote it: `obstacles[0].tip`, without the unions' tags; its last key may be absent."""
    parts: list[str] = []
    here = data

    def named(key: str) -> str:
        return f".{key}" if key.isidentifier() and len(key) <= 60 else f"[{short(key)}]"

    for place, key in enumerate(location):
        last = place == len(location) - 1
        if isinstance(key, int):
            parts.append(f"[{key}]")
            here = here[key] if isinstance(here, Sequence) and key < len(here) else None
        elif isinstance(here, Mapping) and key in here:
            parts.append(named(key))
            here = _plain(here[key])
        elif isinstance(here, Mapping) and last and absent:
            parts.append(named(key))
    return "".join(parts).removeprefix(".") or WHOLE


def _of_kind(location: Sequence[int | str], data: Any) -> str:
    """Of an entry of a kind, which has fields of its own: its kind, in words."""
    here = data
    for key in location[:-1]:
        if isinstance(here, Mapping) and key in here:
            here = _plain(here[key])
        elif isinstance(here, Sequence) and isinstance(key, int) and key < len(here):
            here = here[key]
    return f" of kind {short(here['kind'])}" if isinstance(here, Mapping) and "kind" in here else ""
