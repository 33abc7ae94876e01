"""Files are written whole or not at all."""

from __future__ import annotations

import csv
import io
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

from .errors import SpecError


def ready(folder: str | Path | None) -> None:
    """See that files can be written to a folder, before there is something to lose. Raises `SpecError` otherwise."""
    if folder is None:
        return
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise SpecError(f"{folder}: cannot be written ({error.strerror})") from None


def ready_for(path: Path | None) -> None:
    """See that a file can be written, before there is something to lose. Raises `SpecError` otherwise."""
    if path is not None:
        if path.is_dir():
            raise SpecError(f"{path}: was a folder, must be a file to write")
        ready(path.parent)


def write(path: str | Path, content: str | bytes) -> None:
    """Write next to the target and move into place, so that a reader never sees half of it.

    Raises:
        SpecError: when the folder cannot be written to.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            os.unlink(name)
            raise
    except OSError as error:
        raise SpecError(f"{path}: cannot be written ({error.strerror})") from None


def csv_text(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table as CSV text: a line for the head and one for each row, numbers with all their digits."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return out.getvalue()
