"""When a search comes to its end with the best it has: its time is over, or Ctrl-C was pressed.

A deadline is a `time.perf_counter()` value, called `until` wherever it is handed down to what takes long; one that can
be brought forward carries the event that does so.
"""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Self

# a search leaves this share of its time, and no more than so many seconds, for making its result a plan that keeps all
SHARE, MOST = 0.3, 1.5


class Deadline(float):
    """A `time.perf_counter()` value; `stopped`, once it is set, is the end of the time too.

    met: set when something was told that its time is over; the earlier deadlines that are parts of this one share it.
    """

    stopped: threading.Event | None
    met: threading.Event

    def __new__(cls, at: float, stopped: threading.Event | None = None, met: threading.Event | None = None) -> Self:
        made = super().__new__(cls, at)
        made.stopped, made.met = stopped, met or threading.Event()
        return made


class OverError(Exception):
    """Out of a minimiser in the middle of its work; whoever catches it goes on with the best that was met."""


def after(seconds: float | None, stopped: threading.Event | None = None) -> Deadline:
    """The deadline in so many seconds, or when the event is set; None is none."""
    return Deadline(math.inf if seconds is None else time.perf_counter() + seconds, stopped)


def stopped_by(until: float) -> threading.Event | None:
    """The event that ends the time before its deadline, if there is one."""
    return until.stopped if isinstance(until, Deadline) else None


def over(until: float) -> bool:
    """Whether to come to an end."""
    stopped = stopped_by(until)
    ended = (stopped is not None and stopped.is_set()) or time.perf_counter() > until
    if ended and isinstance(until, Deadline):
        until.met.set()
    return ended


def met(until: float) -> bool:
    """Whether anything was told that its time is over, up to this deadline or an earlier one that is part of it."""
    return isinstance(until, Deadline) and until.met.is_set()


def left(until: float) -> float:
    """Seconds until then, from zero up."""
    return max(until - time.perf_counter(), 0.0)


def part(until: float, share: float = SHARE, most: float = MOST) -> float:
    """An earlier deadline, which leaves a share of the time, and no more than so many seconds."""
    if math.isinf(until):
        return until
    shared = until.met if isinstance(until, Deadline) else None
    return Deadline(until - min(share * left(until), most), stopped_by(until), shared)


@contextmanager
def ended_by_interrupt() -> Iterator[threading.Event]:
    """Inside, the first Ctrl-C sets the event given, for whom it is the end of the time; the second one interrupts.

    In the main thread only: others do not hear Ctrl-C.
    """
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    before = signal.getsignal(signal.SIGINT)

    def end(number: int, frame: FrameType | None) -> None:
        pressed.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, end)
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
