"""Who solves a study's rows: the workers of any executor, or processes of its own.

Those start afresh, are gone when the study is, and are replaced when one dies.
"""

from __future__ import annotations

import multiprocessing
import multiprocessing.util
import os
import signal
import sys
import threading
from collections.abc import Generator, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, ProcessPoolExecutor, as_completed
from contextlib import closing, contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

from ...errors import PeakminError, SpecError
from .row import Row, failed, solved_row

MOST = 60  # processes that a pool can wait for on every system
GUARD = 'a script must call it below `if __name__ == "__main__":`'

Rows = Generator[tuple[str, Row], None, None]  # by their specs' hashes


def each(executor: Executor, waiting: dict[str, str]) -> Rows:
    """The rows of the specs (text by hash) as they are finished.

    Raises:
        BrokenExecutor, CancelledError: when the executor has come to an end.
    """
    with _interrupts_held():
        futures = {executor.submit(solved_row, text): key for key, text in waiting.items()}
    try:
        for future in as_completed(futures):
            try:
                row = future.result()
            except (BrokenExecutor, CancelledError):
                raise
            except Exception as error:
                row = failed(f"{type(error).__name__}: {error}")
            yield futures[future], row
    finally:
        for future in futures:
            future.cancel()


def processors(workers: int | None) -> int:
    """How many processes to start.

    Raises:
        SpecError: for a number of workers below one.
        PeakminError: in a process that is itself just starting, to read the script that it was started from.
    """
    if workers is not None and not (isinstance(workers, int) and workers >= 1):
        raise SpecError(f"workers: was {workers!r}, must be a whole number from 1 up")
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise PeakminError(f"study: was called by one of its own processes; {GUARD}")
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(workers or mine, MOST)


def in_processes(waiting: dict[str, str], workers: int) -> Rows:
    """The rows of the specs (text by hash) as they are finished.

    Where a process dies, the rows that may have been its own are done again, each in a process by itself: the one that
    ends this one, too, is a failed row, and the others go on.

    Raises:
        PeakminError: when processes do not even start.
    """
    total, waiting = len(waiting), dict(waiting)
    while waiting:
        try:
            yield from _while_it_lasts(waiting, min(workers, len(waiting)))
        except BrokenExecutor:
            if len(waiting) == total:
                _try_one()
            for key in list(waiting)[:workers]:  # rows are begun in order, so these were under way
                alone = {key: waiting.pop(key)}
                try:
                    yield from _while_it_lasts(alone, 1)
                except BrokenExecutor:
                    yield key, failed("the process that solved it died")


def _while_it_lasts(waiting: dict[str, str], workers: int) -> Rows:
    """Rows of a fresh pool, taken out of `waiting` as they come."""
    with _pool(workers) as pool, closing(each(pool, dict(waiting))) as found:
        for key, row in found:
            del waiting[key]
            yield key, row


def _try_one() -> None:
    try:
        with _pool(1) as pool:
            pool.submit(os.getpid).result()
    except BrokenExecutor:
        file = getattr(sys.modules["__main__"], "__file__", None)
        why = GUARD if file is None or Path(file).is_file() else "the script must be a file, which they can read too"
        raise PeakminError(f"study: its processes end as they start; {why}") from None


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that leave at once, whatever they are at, when this one leaves the block early, or its life."""
    context = multiprocessing.get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_leave_with, initargs=(theirs,))
    try:
        yield pool
        pool.shutdown()
    finally:
        ours.close()
        pool.shutdown(cancel_futures=True)
        theirs.close()


def _leave_with(study: Connection) -> None:
    multiprocessing.util.Finalize(None, os._exit, (0,), exitpriority=-1000)  # without taking modules apart

    def wait() -> None:
        study.poll(None)  # until its other end is closed
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Processes that are started inside do not hear Ctrl-C: the study does, and ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
