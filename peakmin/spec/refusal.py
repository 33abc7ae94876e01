"""What pydantic finds wrong, in one line: where, what it was, what it must be."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from .reading import WHOLE, short

Location = Sequence[int | str]
FEW = 3  # fields of no name that are said beside the one that is missing
LONGEST = 60  # of a key that is written as it is
PLAIN = {  # pydantic's types of errors in the words of a spec file
    "float_type": "a number",
    "int_type": "a whole number",
    "tuple_type": "a list",
    "model_type": "an object",
    "model_attributes_type": "an object",
}
OWN = ("Input should be ", "Value error, ", "String should ", "Tuple should ")  # how pydantic begins


def one_line(error: ValidationError, data: object) -> str:
    """The finding that says most as `path: was X, must be Y`.

    Args:
        data: what was given.
    """
    found = error.errors(include_url=False)
    union = len(found) > 1 and len({one["loc"][:1] for one in found}) == 1
    # of a value that fits no member of a union, the deepest finding says most
    first = max(found, key=lambda one: len(one["loc"])) if union else found[0]
    return LINES.get(first["type"], _value)(_Finding(first, found, data))


def plain(value: object) -> object:
    """Arrays and numpy scalars as lists and numbers."""
    return value.tolist() if hasattr(value, "tolist") else value


@dataclass(frozen=True)
class _Finding:
    """One of pydantic's findings in what was given, among all."""

    one: ErrorDetails
    among: list[ErrorDetails]
    data: object

    @property
    def where(self) -> str:
        """The location as the user wrote it: `obstacles[0].tip`, without the unions' tags."""
        return _path(self.one["loc"], self.data, absent=self.one["type"] == "missing")

    @property
    def was(self) -> str:
        return short(self.one["input"])

    def detail(self, name: str) -> object:
        """What the finding is about, by pydantic's name for it."""
        return self.one["ctx"][name]


def _missing(at: _Finding) -> str:
    siblings = [one["loc"] for one in at.among if one["type"] == "extra_forbidden"]
    unknown = [short(place[-1]) for place in siblings if place[:-1] == at.one["loc"][:-1]]
    said = f" ({', '.join(unknown)}: no such field)" if 0 < len(unknown) <= FEW else ""
    return f"{at.where}: was missing, must be given{said}"


def _unknown(at: _Finding) -> str:
    *_, (_, entry) = _steps(at.one["loc"], at.data)
    kind = f" of kind {short(entry['kind'])}" if isinstance(entry, Mapping) and "kind" in entry else ""
    return f"{at.where}: was {at.was}, must be left out (no such field{kind})"


def _no_kind(at: _Finding) -> str:
    return f"{at.where}.kind: was missing, must be given"


def _wrong_kind(at: _Finding) -> str:
    given = at.one["input"]
    kind = given.get("kind") if isinstance(given, Mapping) else given
    return f"{at.where}.kind: was {short(kind)}, must be one of {at.detail('expected_tags')}"


def _own_words(at: _Finding) -> str:
    """A validator's words; one of several fields names the one at fault itself, after a dot."""
    said = str(at.detail("error"))
    if said.startswith("."):
        return (("" if at.where == WHOLE else at.where) + said).removeprefix(".")
    return f"{at.where}: was {at.was}, must be {said}"


def _too_short(at: _Finding) -> str:
    return f"{at.where}: was {at.was}, must be a list of at least {at.detail('min_length')}"


def _too_long(at: _Finding) -> str:
    most = at.detail("max_length")
    wanted = "two numbers" if most == 2 else f"at most {most}"
    return f"{at.where}: was {at.was}, must be a list of {wanted}"


def _value(at: _Finding) -> str:
    said = at.one["msg"]
    for start in OWN:
        said = said.removeprefix(start)
    return f"{at.where}: was {at.was}, must be {PLAIN.get(at.one['type'], said)}"


LINES: dict[str, Callable[[_Finding], str]] = {  # by pydantic's types of errors
    "missing": _missing,
    "extra_forbidden": _unknown,
    "union_tag_not_found": _no_kind,
    "union_tag_invalid": _wrong_kind,
    "value_error": _own_words,
    "too_short": _too_short,
    "too_long": _too_long,
}


def _steps(location: Location, data: object) -> Iterator[tuple[int | str, object]]:
    """Each key of a location, and what it is a key of; the unions' tags among them are of nothing and lead nowhere."""
    here = data
    for key in location:
        yield key, here
        if isinstance(key, int):
            here = here[key] if isinstance(here, Sequence) and key < len(here) else None
        elif isinstance(here, Mapping) and key in here:
            here = plain(here[key])


def _path(location: Location, data: object, absent: bool) -> str:
    """A location as the user wrote it; absent: its last key is not there."""
    parts: list[str] = []
    for place, (key, here) in enumerate(_steps(location, data), 1):
        if isinstance(key, int):
            parts.append(f"[{key}]")
        elif isinstance(here, Mapping) and (key in here or (absent and place == len(location))):
            parts.append(f".{key}" if key.isidentifier() and len(key) <= LONGEST else f"[{short(key)}]")
    return "".join(parts).removeprefix(".") or WHOLE
