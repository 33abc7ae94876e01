"""Finished rows of a study on disk: one line of JSON each, there to stay before the next one is waited for."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from ...errors import SpecError

SUFFIX = ".journal"


class Journal:
    """Rows by their spec's hash, read from the file beside `store` and appended to it; in memory where it is None.

    A line that a power cut or a kill left torn is passed over. Of a spec's rows the last one counts.

    Raises:
        SpecError: on entering, when the file cannot be written or another study is writing it.
    """

    def __init__(self, store: Path | None) -> None:
        self.path = None if store is None else store.with_name(store.name + SUFFIX)
        self.rows: dict[str, dict[str, Any]] = {}
        self._file: BinaryIO | None = None

    def __enter__(self) -> Self:
        if self.path is None:
            return self
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(self.path, "a+b")
            _lock(self._file, self.path)
            if self._read():
                self._file.write(b"\n")
        except OSError as error:
            raise SpecError(f"{self.path}: cannot be written ({error.strerror})") from None
        except SpecError:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._file is not None:
            self._file.close()

    def add(self, row: dict[str, Any]) -> None:
        """Keep a finished row, which names its `spec`. Raises `SpecError` when the disk does not take it."""
        if self._file is None:
            self.rows[row["spec"]] = row
            return
        try:
            self._file.write(json.dumps(row, allow_nan=False).encode() + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise SpecError(f"{self.path}: cannot be written ({error.strerror})") from None
        self.rows[row["spec"]] = row

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


def _row(line: bytes) -> dict[str, Any] | None:
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) and isinstance(row.get("spec"), str) and "status" in row else None


def _lock(file: BinaryIO, path: Path) -> None:
    """Refuse a second writer; the lock goes with the process. File systems without locks are trusted."""
    if sys.platform == "win32":
        return
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SpecError(f"{path}: was in use by another study, must be written by one at a time") from None
    except OSError:
        pass
