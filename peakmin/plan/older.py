"""Plan files of every version, those of older ones read as what they would be in the present one.

They call "solved" all that keeps what was asked. Those of version 2 say nothing of what an arm's joints do at most.
Those of version 1 do not name the kind of a centre of mass's plan either, list walls past blocks only, and state the
proof past blocks as a list of branches in place of a tree.
"""

from __future__ import annotations

from collections.abc import Callable

from ..errors import SpecError
from ..spec.reading import load, short
from ..spec.settings import GlobalSearch
from ..spec.spec import Spec
from ..types import Json
from .document import VERSION, D, P, made_of, plain

KNOWN = (1, 2, 3)
SINCE_3 = ("held", "peak_moment", "extremes")  # what older files of arms do not state


def stated(text: str | bytes) -> tuple[Json, Json]:
    """A document's data as the file has them, and as one of the present version. Raises `SpecError` in one line."""
    data = load(text, finite=True)
    version = data.get("version")
    if type(version) is not int or version not in KNOWN:
        raise SpecError(f"version: was {short(version)}, must be 1, 2 or 3 (the versions so far)")
    return data, data if version == VERSION else _upgraded(data)


def _upgraded(data: Json) -> Json:
    """A document of an older version as one of the present, as far as it is one at all."""
    new = {"kind": "point", "costate": None, **data, "version": VERSION, **_graded(data)}
    if isinstance(data.get("made"), dict):
        new["made"] = {"stopped": False, **data["made"]}
    if new["kind"] == "arm":
        for name in SINCE_3:
            if name in data:
                raise SpecError(f"{name}: was given, must be left out in version {data['version']}")
        new |= dict.fromkeys(SINCE_3)
    if data["version"] == 2:
        return new
    proof = data.get("proof")
    if new["kind"] == "arm":
        new["proof"] = {"kind": "arm", "passages": proof, "cells": new.pop("flooded", 0)}
        return {"path": None, **new}
    blocks = "walls" in data
    new["proof"] = {"kind": "listed", "branches": proof} if blocks else {"kind": "walls", "leaves": proof}
    if not blocks:
        maneuver = Spec(**data["spec"]).maneuver if isinstance(data.get("spec"), dict) else None
        new["walls"] = [] if maneuver is None else [plain(wall) for wall in maneuver.walls]
    return new


def _graded(data: Json) -> Json:
    """Status and spec of an older document: its searches accepted any gap (now the default's), without a limit."""
    spec, accept = data.get("spec"), GlobalSearch().accept
    settings = spec.get("settings") if isinstance(spec, dict) else None
    search = settings.get("search") if isinstance(settings, dict) else None
    if not (isinstance(spec, dict) and isinstance(settings, dict) and isinstance(search, dict)):
        return {}
    asked = {"time_limit": None, **settings, "search": {"accept": accept, **search}}
    new: Json = {"spec": {**spec, "settings": asked}}
    gap = data.get("gap")
    if data.get("status") == "solved" and isinstance(gap, float) and gap > accept:
        new["status"] = "feasible"
    return new


def read_as(kind: type[D], made: Callable[[D], P], text: str | bytes) -> P:
    """What `made` makes of a document of this kind. Raises `SpecError` in one line where it is none."""
    return made_of(kind, made, stated(text)[1])
