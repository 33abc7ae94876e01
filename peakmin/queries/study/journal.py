"""Finished rows of a study on disk: one line of JSON each, there to stay before the next one is waited for."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self, cast

from filelock import FileLock, Timeout

from ...errors import SpecError
from .row import Row

SUFFIX, LOCK = ".journal", ".lock"


class StoredRow(Row):
    """A row and the hash of its spec."""

    spec: str


class Journal:
    """Rows by their spec's hash, read from the file beside `store` and appended to it; in memory where it is None.

    A line that a power cut or a kill left torn is passed over. Of a spec's rows the last one counts. Who writes holds
    a lock, which goes with the process; its empty file stays, or two who find none could each hold one of their own.

    Raises:
        SpecError: on entering, when the file cannot be written or another study is writing it.
    """

    def __init__(self, store: Path | None) -> None:
        self.path = None if store is None else store.with_name(store.name + SUFFIX)
        self.rows: dict[str, StoredRow] = {}
        self._file: BinaryIO | None = None
        self._open = ExitStack()

    def __enter__(self) -> Self:
        if self.path is None:
            return self
        with ExitStack() as opened:
            try:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                opened.enter_context(FileLock(f"{self.path}{LOCK}", timeout=0))
                self._file = opened.enter_context(open(self.path, "a+b"))
                if self._read():
                    self._file.write(b"\n")
            except Timeout:
                raise SpecError(f"{self.path}: was in use by another study, must be written by one at a time") from None
            except OSError as error:
                raise SpecError(f"{self.path}: cannot be written ({error.strerror})") from None
            self._open = opened.pop_all()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._open.close()

    def add(self, key: str, row: Row) -> None:
        """Keep the finished row of a spec. Raises `SpecError` when the disk does not take it."""
        kept = StoredRow(spec=key, **row)
        if self._file is not None:
            try:
                self._file.write(json.dumps(kept, allow_nan=False).encode() + b"\n")
                self._file.flush()
                os.fsync(self._file.fileno())
            except OSError as error:
                raise SpecError(f"{self.path}: cannot be written ({error.strerror})") from None
        self.rows[key] = kept

    def done(self, keys: Iterable[str]) -> set[str]:
        """Which of these specs have an answer, a failure being none."""
        return {key for key in keys if key in self.rows and self.rows[key]["status"] != "failed"}

    def look_again(self) -> None:
        """Take the rows from the file anew: an interrupt may have come between its line and `rows`."""
        if self._file is not None:
            self._file.flush()
            self._read()

    def _read(self) -> bytes:
        """Read the file's rows; what stands after its last line break, a row that lacks but this one included."""
        assert self._file is not None
        self._file.seek(0)
        lines = self._file.read().split(b"\n")
        for row in filter(None, map(_row, lines)):
            self.rows[row["spec"]] = row
        return lines[-1]


def _row(line: bytes) -> StoredRow | None:
    try:
        row: object = json.loads(line)
    except ValueError:
        return None
    whole = isinstance(row, dict) and isinstance(row.get("spec"), str) and "status" in row
    return cast(StoredRow, row) if whole else None
