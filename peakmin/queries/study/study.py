"""Many problems: any executor solves them, a journal keeps what is finished."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import PeakminError, SpecError
from ...spec.spec import Spec
from ...spec.study import StudySpec
from ...types import Progress
from .journal import Journal
from .table import Study, refuse
from .workers import each, in_processes, processors, spec_hash

if TYPE_CHECKING:
    from ...spec.spec import ArmSpec


def study(
    specs: StudySpec | Iterable[Spec | ArmSpec],
    executor: Executor | None = None,
    store: str | Path | None = None,
    *,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Study:
    """Solve every spec, each different one once, and give one row for each in the order given.

    A finished row is on disk before the next one is waited for. A study that was stopped, by Ctrl-C, by a kill or a
    power cut, goes on where it was when it is run again; rows that failed are then tried again.

    Args:
        specs: a `StudySpec`, or specs of centres of mass and of arms in any mixture.
        executor: whose workers solve; default processes of its own. It must carry a function of peakmin and its
            text to a place where peakmin is installed, as those of `concurrent.futures` and dask do.
        store: table to write when all rows are there, .csv or .parquet; the journal stands beside it. Default: none.
        workers: how many processes where no executor is given; default one for each processor.
        progress: called with (done, total) of the different specs.

    Raises:
        SpecError: before anything is solved, when a spec or the store is wrong.
        PeakminError: when the executor came to an end before the rows did.
        KeyboardInterrupt: on Ctrl-C, saying how many rows are done.
    """
    path = None if store is None else Path(store)
    refuse(path)
    count = processors(workers) if executor is None else 0
    asked, varied = _rows(specs)
    texts = [spec.to_json(indent=None) for spec in asked]
    keys = [spec_hash(spec) for spec in asked]
    with Journal(path) as journal:
        known = journal.done(keys)
        waiting = {key: text for key, text in zip(keys, texts, strict=True) if key not in known}
        done, total = len(known), len(known) + len(waiting)
        found = in_processes(waiting, count) if executor is None else each(executor, waiting)
        try:
            with closing(found):
                if progress:
                    progress(done, total)
                for key, row in found:
                    journal.add({"spec": key, **row})
                    done += 1
                    if progress:
                        progress(done, total)
        except KeyboardInterrupt:
            journal.look_again()
            raise KeyboardInterrupt(f"{len(journal.done(keys))} of {total} rows done{_how_to_go_on(path)}") from None
        except (BrokenExecutor, CancelledError) as error:
            why = f" ({error})" if str(error) else ""
            left = f"{done} of {total} rows done{_how_to_go_on(path)}"
            raise PeakminError(f"the executor ended{why}: {left}") from None
        rows = tuple({"spec": key, **own, **journal.rows[key]} for key, own in zip(keys, varied, strict=True))
    made = Study(rows, tuple(varied[0]))
    made.write(path)
    return made


def _how_to_go_on(path: Path | None) -> str:
    return ", nothing kept (a store keeps them)" if path is None else "; the same study run again goes on from there"


def _rows(specs: StudySpec | Iterable[Spec | ArmSpec]) -> tuple[list[Spec | ArmSpec], list[dict[str, Any]]]:
    """The specs, and for each what varies, by path."""
    from ...spec.spec import ArmSpec

    if isinstance(specs, StudySpec):
        return list(specs.specs), specs.varied
    if isinstance(specs, str | bytes | Mapping | Path):
        raise SpecError(f"specs: was a {type(specs).__name__}, must be a list of specs or a StudySpec (StudySpec.read)")
    asked = list(specs)
    for i, spec in enumerate(asked):
        if not isinstance(spec, Spec | ArmSpec):
            raise SpecError(f"specs[{i}]: was a {type(spec).__name__}, must be a peakmin.Spec or a peakmin.ArmSpec")
    if not asked:
        raise SpecError("specs: was empty, must be at least one")
    fields = [dict(_leaves(json.loads(spec.to_json()))) for spec in asked]
    names = list(dict.fromkeys(name for own in fields for name in own))
    differ = [name for name in names if any(own.get(name) != fields[0].get(name) for own in fields)]
    return asked, [{name: own.get(name) for name in differ} for own in fields]


def _leaves(data: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _leaves(value, f"{path}.{key}" if path else key)
    elif isinstance(data, list):
        for i, value in enumerate(data):
            yield from _leaves(value, f"{path}[{i}]")
    else:
        yield path, data
