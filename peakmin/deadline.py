"""When a search comes to its end with the best it has: its time is over, or Ctrl-C was pressed.

A deadline is a `time.perf_counter()` value, called `until` wherever it is handed down to what takes long.
"""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

# a search leaves this share of its time, and no more than so many seconds, for making its result a plan that keeps all
SHARE, MOST = 0.3, 1.5
_asked = threading.Event()


class OverError(Exception):
    """Out of a minimiser in the middle of its work; whoever catches it goes on with the best that was met."""


def after(seconds: float | None) -> float:
    """The deadline in so many seconds; None is none."""
    return math.inf if seconds is None else time.perf_counter() + seconds


def over(until: float) -> bool:
    """Whether to come to an end."""
    return _asked.is_set() or time.perf_counter() > until


def left(until: float) -> float:
    """Seconds until then, from zero up."""
    return max(until - time.perf_counter(), 0.0)


def part(until: float) -> float:
    """An earlier deadline, which leaves some of the time."""
    return until - min(SHARE * left(until), MOST) if math.isfinite(until) else until


@contextmanager
def ended_by_interrupt() -> Iterator[threading.Event]:
    """Inside, the first Ctrl-C is the end of the time, and sets the event given; the second one interrupts.

    In the main thread only: others do not hear Ctrl-C.
    """
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    before = signal.getsignal(signal.SIGINT)

    def end(number: int, frame: FrameType | None) -> None:
        pressed.set()
        _asked.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, end)
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
        _asked.clear()
