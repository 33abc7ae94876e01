"""JSON documents from files, within limits; what is refused as a whole, in one line."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from ..errors import SpecError
from ..types import Json

MAX_FILE_BYTES = 64 * 2**20
MOST_PARTS = 5_000_000  # lists and objects of a document: each takes some hundred bytes
MOST_DEEP = 500  # one in another; less than what Python and pydantic follow
MOST_KEYS = 1000  # of one object: each that is not known costs pydantic a finding
WHOLE = "the document"
STDIN = "-"  # for a file's name
KINDS = {  # of files, by the entry that tells, with the verb that reads them
    "digest": ("plan", "verify"),
    "base": ("study file", "study"),
    "maneuver": ("spec", "solve"),
}


def load(text: str | bytes, finite: bool = False) -> Json:
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
        raise SpecError(f"{called(path)}{said.removeprefix(WHOLE)}" if said.startswith(WHOLE + ":") else said) from None


def called(path: str | Path) -> str:
    """A file's name as it is said: "stdin" for -."""
    return "stdin" if str(path) == STDIN else str(path)


def of_kind(data: Mapping[str, object], wanted: str) -> None:
    """Refuse a document of another kind by its name. Raises `SpecError`."""
    told = dict(KINDS[key] for key in KINDS if key in data)
    if told and wanted not in told:
        kind, verb = next(iter(told.items()))
        raise SpecError(f"{WHOLE}: was a {kind} (see `peakmin {verb}`), must be a {wanted}")


def read_file(path: str | Path) -> bytes:
    """A file's bytes, those of stdin for -. Raises `SpecError` with one line when it cannot be read or is too large."""
    try:
        if str(path) == STDIN:
            if sys.stdin is None:
                raise ValueError("it is closed")
            text = sys.stdin.buffer.read(MAX_FILE_BYTES + 1)
        else:
            with open(path, "rb") as file:
                text = file.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:  # a path with a NUL is the latter
        raise SpecError(f"{called(path)}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(text) > MAX_FILE_BYTES:
        raise SpecError(f"{called(path)}: was over {MAX_FILE_BYTES // 2**20} MiB, must be smaller")
    return text


def short(value: object, length: int = 60) -> str:
    """The value's repr on one line, cut after `length` characters."""
    if isinstance(value, str | bytes) and len(value) > length:
        value = value[:length]
    elif isinstance(value, Mapping | list | tuple) and len(value) > 8:
        return f"a {type(value).__name__} of {len(value)}"
    text = repr(value).replace("\n", " ")
    return text if len(text) <= length else text[:length] + "..."


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no JSON number")


def _unique(pairs: list[tuple[str, object]]) -> Json:
    if len(pairs) > MOST_KEYS:
        raise SpecError(f"{WHOLE}: was one with an object of {len(pairs)} keys, must have at most {MOST_KEYS}")
    keys = [key for key, _ in pairs]
    if len(set(keys)) < len(keys):
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {short(twice)} stands twice")
    return dict(pairs)


def _ends_within(data: object, depth: int) -> bool:
    """Whether no list or object lies in more than so many others."""
    level = [data]
    for _ in range(depth + 1):
        nested = [one for one in level if isinstance(one, dict | list)]
        if not nested:
            return True
        level = [part for one in nested for part in (one.values() if isinstance(one, dict) else one)]
    return False
