"""Many specs from one: fields of a base spec that run through values."""

from __future__ import annotations

import copy
import itertools
import json
import math
import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from ..errors import SpecError
from ..types import Json
from .model import Model
from .reading import load, named, of_kind, read_file
from .refusal import plain
from .spec import AnySpec, known_version, spec_of

MOST_ROWS = 100_000
EXAMPLE = "maneuver.obstacles[0].tip[1]"
PATH = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*|\[\d+\])*")


def _plain(value: object) -> object:
    """Arrays, numpy scalars and models as JSON values, also inside lists."""
    if isinstance(value, Model):
        return json.loads(value.to_json())
    value = plain(value)
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _path(path: str) -> str:
    if not PATH.fullmatch(path):
        raise ValueError(f"a field's path like {EXAMPLE}")
    return path


Values = Annotated[tuple[object, ...], Field(min_length=1), BeforeValidator(_plain)]
Varied = dict[Annotated[str, AfterValidator(_path)], Values]


class StudySpec(Model):
    """A whole study file: a base spec and the fields of it that vary.

    Args:
        base: a spec, of a centre of mass or of an arm, or the path of its file (in a study file: seen from there).
        grid: values by the field's path, such as "settings.circle.segments" or "maneuver.obstacles[0].tip[1]"; every
            combination is a row, the last field changing fastest.
        zip: values by path that go together, the first of each, then the second; combined with the grid, they
            change fastest.

    Raises:
        SpecError: when a field is wrong, of the study or of any of its specs.
    """

    version: Annotated[int, Field(strict=True), AfterValidator(known_version)] = 1
    base: Json
    grid: Annotated[Varied, Field(default_factory=dict)]
    zip: Annotated[Varied, Field(default_factory=dict)]

    def __init__(self, **data: object) -> None:
        base = data.get("base")
        if isinstance(base, str | Path):
            with named(base):
                base = load(read_file(base))
        super().__init__(**data | ({"base": _plain(base)} if "base" in data else {}))

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a study file. Raises `SpecError` with one line when it, or its base, cannot be read or is wrong."""
        with named(path):
            data = load(read_file(path))
            of_kind(data, "study file")
        if isinstance(data.get("base"), str):
            data["base"] = Path(path).parent / data["base"]
        return cls(**data)

    @model_validator(mode="after")
    def _makes_rows(self) -> StudySpec:
        lengths = {len(values) for values in self.zip.values()}
        if len(lengths) > 1:
            raise ValueError(
                f".zip: was lists of {' and '.join(map(str, sorted(lengths)))} values, must be of one length"
            )
        for path in self.zip:
            if path in self.grid:
                raise ValueError(f".zip: was given {path}, must leave it to the grid, which has it too")
        rows = math.prod(len(values) for values in self.grid.values()) * max(lengths, default=1)
        if rows > MOST_ROWS:
            raise ValueError(f".grid: was {rows} rows, must be at most {MOST_ROWS}")
        try:
            self.specs  # noqa: B018  bad ones are refused here
        except SpecError as error:
            raise ValueError(f".{error}") from None
        return self

    @property
    def varied(self) -> list[dict[str, object]]:
        """What each row has for the varied fields, by path."""
        together = [dict(zip(self.zip, one, strict=True)) for one in zip(*self.zip.values(), strict=True)] or [{}]
        crossed = (dict(zip(self.grid, one, strict=True)) for one in itertools.product(*self.grid.values()))
        return [{**one, **more} for one in crossed for more in together]

    @cached_property
    def specs(self) -> tuple[AnySpec, ...]:
        """The spec of each row."""
        return tuple(self._spec(i, row) for i, row in enumerate(self.varied))

    @cached_property
    def _filled(self) -> Json:
        """The base with its defaults written out, so that fields inside them can be named."""
        try:
            return load(spec_of(self.base).to_json())
        except SpecError:
            return self.base  # what it lacks may be what varies

    def _spec(self, i: int, row: Mapping[str, object]) -> AnySpec:
        data = copy.deepcopy(self.base)
        for path, value in row.items():
            if not _put(data, self._filled, path, value):
                raise SpecError(f"{path}: was varied, must be a field of the base")
        try:
            return spec_of(data)
        except SpecError as error:
            where = f" (row {i}: {', '.join(f'{path} = {value!r}' for path, value in row.items())})" if row else ""
            raise SpecError(f"{error}{where}") from None


def _put(data: object, filled: object, path: str, value: object) -> bool:
    """Set the field of `data`, making what is missing on the way like `filled`; whether there is such a place."""
    *way, last = (int(key) if key.isdigit() else key for key in re.findall(r"\w+", path))
    for key in way:
        filled = _at(filled, key)
        if isinstance(data, dict) and key not in data and isinstance(filled, dict | list):
            data[key] = _begun(filled)
        data = _at(data, key)
    if isinstance(data, dict) and isinstance(last, str):
        data[last] = copy.deepcopy(value)
        return True
    if isinstance(data, list) and isinstance(last, int) and last < len(data):
        data[last] = copy.deepcopy(value)
        return True
    return False


def _begun(filled: dict[str, object] | list[object]) -> object:
    """What stands for an entry that was left to its default, before a field of it is set: its kind, a list's values."""
    if isinstance(filled, list):
        return [*filled]
    return {"kind": filled["kind"]} if "kind" in filled else {}


def _at(data: object, key: str | int) -> object:
    if isinstance(key, str):
        return data.get(key) if isinstance(data, dict) else None
    return data[key] if isinstance(data, list) and key < len(data) else None
