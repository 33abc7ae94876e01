"""stdout carries what was asked for and nothing else, whatever the solvers' libraries print."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from contextvars import ContextVar
from typing import TextIO

from ..errors import PeakminError

STDOUT, STDERR = 1, 2  # descriptors
_written: ContextVar[Callable[[str], None]] = ContextVar("what writes an answer")


def answer(text: str, end: str = "\n") -> None:
    """Write to stdout, at once. Only inside `only_answers`.

    Raises:
        BrokenPipeError: when its reader has gone.
        PeakminError: when it cannot be written.
    """
    try:
        _written.get()(text + end)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise PeakminError(f"stdout: cannot be written ({error.strerror})") from None


def aside(text: str) -> None:
    """Write a line to stderr, where there is one: `print` takes stdout for a stderr that is closed."""
    if sys.stderr is not None:
        print(text, file=sys.stderr)


@contextmanager
def only_answers() -> Iterator[None]:
    """Inside, what is printed goes to stderr, and stdout has what is given to `answer`.

    LAPACK and solvers may print from C: it is the descriptor that points to stderr, not only Python's `sys.stdout`.
    """
    _open_all()
    stream, saved = sys.stdout, os.dup(STDOUT)
    _flush(stream)
    os.dup2(STDERR, STDOUT)
    token = _written.set(_writer(stream, saved))
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _written.reset(token)
        _flush(stream)
        os.dup2(saved, STDOUT)
        os.close(saved)


def _writer(stream: TextIO | None, saved: int) -> Callable[[str], None]:
    """What writes where Python's stdout has led: by the descriptor saved, or to an object in its place, as in tests."""
    if stream is None:  # closed
        return lambda text: None
    try:
        real = stream.fileno() == STDOUT
    except OSError:  # in memory
        real = False
    if not real:
        return lambda text: print(text, end="", file=stream, flush=True)
    encoding, errors = stream.encoding, stream.errors or "strict"

    def write(text: str) -> None:
        data = text.encode(encoding, errors)
        while data:
            data = data[os.write(saved, data) :]

    return write


def _open_all() -> None:
    """Let standard descriptors that are closed lead nowhere: the next file to be opened would be taken for them."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= STDERR:
        pass
    os.close(descriptor)


def _flush(stream: TextIO | None) -> None:
    """Write out what is waiting, in Python's stream and in those of C."""
    if stream is not None:
        stream.flush()
    ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)
