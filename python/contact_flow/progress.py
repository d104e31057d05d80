# SPDX-License-Identifier: BSD-3-Clause
"""A line on a terminal while something takes long: what is done by now, how much of it, and since when."""
from __future__ import annotations

import threading
import time
from types import TracebackType
from typing import Optional, TextIO, Type

WIDTH = 24  #: of the bar
WAIT = 0.5  #: quick work is not told of [s]


def line(what: str, done: int, total: int, seconds: float) -> str:
    """One look at it: a bar where the total is known.

    >>> line("quotients", 2, 8, 3.4)
    '[######..................] quotients, 2 of 8, 3 s'
    >>> line("the run", 0, 0, 12.7)
    'the run, 12 s'
    """
    if total <= 0:
        return "%s, %d s" % (what, seconds)
    full = WIDTH * done // total
    return "[%s%s] %s, %d of %d, %d s" % ("#" * full, "." * (WIDTH - full), what, done, total, seconds)


class Progress:
    """Shows a line on `stream` while it is entered, if that is a terminal; `tell` says what is being done."""

    def __init__(self, stream: Optional[TextIO]) -> None:
        self.stream = stream if stream is not None and stream.isatty() else None
        self.what, self.done, self.total = "", 0, 0
        self.begin = time.monotonic()
        self.ended = threading.Event()
        self.thread: Optional[threading.Thread] = None

    def tell(self, what: str, done: int = 0, total: int = 0) -> None:
        self.what, self.done, self.total = what, done, total

    def __enter__(self) -> "Progress":
        if self.stream is not None:
            self.thread = threading.Thread(target=self._show, args=(self.stream,), daemon=True)
            self.thread.start()
        return self

    def _show(self, stream: TextIO) -> None:
        if self.ended.wait(WAIT):
            return
        while True:
            if self.what:
                stream.write("\r" + line(self.what, self.done, self.total, time.monotonic() - self.begin) + "\x1b[K")
                stream.flush()
            if self.ended.wait(0.2):
                break
        stream.write("\r\x1b[K")
        stream.flush()

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.ended.set()
        if self.thread is not None:
            self.thread.join()
