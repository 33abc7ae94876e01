"""What each thread has for itself."""

from __future__ import annotations

import threading

from ..programs.program import Programs


class OfThread(threading.local):
    """Programs for the solves of the thread that asks, one after the other."""

    def __init__(self) -> None:
        self.programs = Programs()
