"""Frozen pydantic models whose refusals are one line: field path, what it was, what it must be."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from .errors import SpecError

LARGEST = 1e100  # of any number in a spec, in SI units: squares and products stay finite
FASTEST = 1e90  # m/s^2, of a maneuver's own size: what comes of it stays below LARGEST
MAX_FILE_BYTES = 64 * 2**20
MOST_PARTS = 5_000_000  # lists and objects of a document: each takes some hundred bytes
MOST_DEEP = 500  # one in another; less than what Python and pydantic follow
MOST_KEYS = 1000  # of one object: each that is not known costs pydantic a finding
WHOLE = "the document"
KINDS = {  # of files, by the entry that tells, with the verb that reads them
    "digest": ("plan", "verify"),
    "base": ("study file", "study"),
    "maneuver": ("spec", "solve"),
}
PLAIN = {  # pydantic's error types in the words of a spec file
    "float_type": "a number",
    "int_type": "a whole number",
    "tuple_type": "a list",
    "model_type": "an object",
    "model_attributes_type": "an object",
}


def _plain(value: Any) -> Any:
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

    def check(value: Any) -> Any:
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


def load(text: str | bytes, finite: bool = False) -> dict[str, Any]:
    """One JSON object. Raises `SpecError` with one line for anything else, duplicate keys included.

    Args:
        finite: refuse NaN and infinities here; a spec's models name their field.
    """
    parts = text.count("[") + text.count("{") if isinstance(text, str) else text.count(b"[") + text.count(b"{")
    if parts > MOST_PARTS:
        raise SpecError(f"{WHOLE}: was {parts} lists and objects, must be at most {MOST_PARTS}")
    try:
        data = json.loads(text, object_pairs_hook=_unique, parse_constant=_refuse if finite else None)
        shallow = _ends_within(data, MOST_DEEP)
    except RecursionError:
        shallow = False
    except SpecError:
        raise
    except (ValueError, UnicodeDecodeError) as error:
        if "integer string conversion" in str(error):
            raise SpecError(f"{WHOLE}: was one with a number of too many digits, must have at most 4300") from None
        raise SpecError(f"{WHOLE}: was not JSON ({short(str(error), 120)})") from None
    if not shallow:
        raise SpecError(f"{WHOLE}: was nested too deeply, must be at most {MOST_DEEP} lists and objects deep")
    if not isinstance(data, dict):
        raise SpecError(f"{WHOLE}: was {short(data)}, must be a JSON object")
    return data


@contextmanager
def named(path: str | Path) -> Iterator[None]:
    """Calls the document by its file's name where it is refused as a whole."""
    try:
        yield
    except SpecError as error:
        said = str(error)
        raise SpecError(f"{path}{said.removeprefix(WHOLE)}" if said.startswith(WHOLE + ":") else said) from None


def of_kind(data: Mapping[str, Any], wanted: str) -> None:
    """Refuse a document of another kind by its name. Raises `SpecError`."""
    told = dict(KINDS[key] for key in KINDS if key in data)
    if told and wanted not in told:
        kind, verb = next(iter(told.items()))
        raise SpecError(f"{WHOLE}: was a {kind} (see `peakmin {verb}`), must be a {wanted}")


def read_file(path: str | Path) -> bytes:
    """A file's bytes. Raises `SpecError` with one line when it cannot be read or is too large."""
    try:
        with open(path, "rb") as file:
            text = file.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:  # a path with a NUL is the latter
        raise SpecError(f"{path}: cannot be read ({getattr(error, 'strerror', error)})") from None
    if len(text) > MAX_FILE_BYTES:
        raise SpecError(f"{path}: was over {MAX_FILE_BYTES // 2**20} MiB, must be smaller")
    return text


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


def _is_union(found: Sequence[Any]) -> bool:
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


def short(value: Any, length: int = 60) -> str:
    """The value's repr on one line, cut after `length` characters."""
    if isinstance(value, str | bytes) and len(value) > length:
        value = value[:length]
    elif isinstance(value, Mapping | list | tuple) and len(value) > 8:
        return f"a {type(value).__name__} of {len(value)}"
    text = repr(value).replace("\n", " ")
    return text if len(text) <= length else text[:length] + "..."


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no JSON number")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(pairs) > MOST_KEYS:
        raise SpecError(f"{WHOLE}: was one with an object of {len(pairs)} keys, must have at most {MOST_KEYS}")
    keys = [key for key, _ in pairs]
    if len(set(keys)) < len(keys):
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {short(twice)} stands twice")
    return dict(pairs)


def _ends_within(data: Any, depth: int) -> bool:
    """Whether no list or object lies in more than so many others."""
    level = [data]
    for _ in range(depth + 1):
        level = [one for one in level if isinstance(one, dict | list)]
        if not level:
            return True
        level = [part for one in level for part in (one.values() if isinstance(one, dict) else one)]
    return False
