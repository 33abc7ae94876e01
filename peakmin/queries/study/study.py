"""Many problems: any executor solves them, a journal keeps what is finished."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from contextlib import closing, contextmanager
from pathlib import Path

from ...errors import PeakminError, SpecError
from ...spec.spec import AnySpec
from ...spec.study import StudySpec
from ...types import Progress
from .journal import Journal
from .row import spec_hash
from .table import Study, refuse
from .workers import Rows, each, in_processes, processors


def study(
    specs: StudySpec | Iterable[AnySpec],
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
    asked, varied = _asked(specs)
    keys = [spec_hash(spec) for spec in asked]
    texts = {key: spec.to_json(indent=None) for key, spec in zip(keys, asked, strict=True)}
    with Journal(path) as journal:
        known = journal.done(texts)
        waiting = {key: text for key, text in texts.items() if key not in known}
        found = in_processes(waiting, count) if executor is None else each(executor, waiting)
        with _said_how_far(journal, texts, path), closing(found):
            _keep(found, journal, len(known), len(texts), progress)
        rows = tuple({"spec": key, **own, **journal.rows[key]} for key, own in zip(keys, varied, strict=True))
    made = Study(rows, tuple(varied[0]))
    made.write(path)
    return made


def _keep(found: Rows, journal: Journal, done: int, total: int, progress: Progress | None) -> None:
    """Put every row into the journal as it comes."""
    if progress:
        progress(done, total)
    for key, row in found:
        journal.add(key, row)
        done += 1
        if progress:
            progress(done, total)


@contextmanager
def _said_how_far(journal: Journal, keys: Collection[str], path: Path | None) -> Iterator[None]:
    """What ends a study before its rows are there says how many of them are."""
    then = ", nothing kept (a store keeps them)" if path is None else "; the same study run again goes on from there"
    try:
        yield
    except KeyboardInterrupt:
        journal.look_again()
        raise KeyboardInterrupt(f"{len(journal.done(keys))} of {len(keys)} rows done{then}") from None
    except (BrokenExecutor, CancelledError) as error:
        why = f" ({error})" if str(error) else ""
        done = f"{len(journal.done(keys))} of {len(keys)} rows done{then}"
        raise PeakminError(f"the executor ended{why}: {done}") from None


def _asked(specs: StudySpec | Iterable[AnySpec]) -> tuple[list[AnySpec], list[dict[str, object]]]:
    """The specs, and for each what varies, by path."""
    if isinstance(specs, StudySpec):
        return list(specs.specs), specs.varied
    if isinstance(specs, str | bytes | Mapping | Path):
        raise SpecError(f"specs: was a {type(specs).__name__}, must be a list of specs or a StudySpec (StudySpec.read)")
    asked = list(specs)
    for i, spec in enumerate(asked):
        if not isinstance(spec, AnySpec):
            raise SpecError(f"specs[{i}]: was a {type(spec).__name__}, must be a peakmin.Spec or a peakmin.ArmSpec")
    if not asked:
        raise SpecError("specs: was empty, must be at least one")
    fields = [dict(_leaves(json.loads(spec.to_json()))) for spec in asked]
    names = list(dict.fromkeys(name for own in fields for name in own))
    differ = [name for name in names if any(own.get(name) != fields[0].get(name) for own in fields)]
    return asked, [{name: own.get(name) for name in differ} for own in fields]


def _leaves(data: object, path: str = "") -> Iterator[tuple[str, object]]:
    """What stands in JSON data, by path."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _leaves(value, f"{path}.{key}" if path else key)
    elif isinstance(data, list):
        for i, value in enumerate(data):
            yield from _leaves(value, f"{path}[{i}]")
    else:
        yield path, data
