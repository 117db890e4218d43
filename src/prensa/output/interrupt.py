"""Ctrl-C and SIGTERM stop the solver at once and a writer never: a file being written is finished first."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any

IMPORT_WAIT = 0.05
"""Seconds until a signal that came while a module was imported is looked at again: less than anybody notices."""
IMPORTING = "<frozen importlib._bootstrap>"
"""File name in the code of Python's import."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, by which systems and queues of clusters end a process: as Ctrl-C, but nobody at a terminal pressed it."""


class Interruptible:
    """Context manager that replaces the handlers of SIGINT and SIGTERM; does nothing outside the main thread.

    Inside ``with guard.postponed():`` a Ctrl-C waits for the end of the block and then raises KeyboardInterrupt, SIGTERM
    `Terminated`. A handler of SIGTERM that a program has set stays; that of a guard around this one is replaced until the end
    of this one. While a module is imported inside the guard signals wait too: a half-imported package fails ever after, in
    notebooks too. A module that solves as it is imported, and so enters the guard, is stopped as a script is.
    """

    def __init__(self) -> None:
        self._depth, self._pending, self._outside = 0, 0, 0
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> Interruptible:
        self._outside = _imports(sys._getframe())
        if threading.current_thread() is threading.main_thread():
            self._previous[signal.SIGINT] = signal.signal(signal.SIGINT, self._received)
            before = signal.getsignal(signal.SIGTERM)
            if before is signal.SIG_DFL or isinstance(getattr(before, "__self__", None), Interruptible):
                self._previous[signal.SIGTERM] = signal.signal(signal.SIGTERM, self._received)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    @contextmanager
    def postponed(self) -> Iterator[None]:
        """Hold signals back until the block is done; an error of the block goes first."""
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
        if self._pending and not self._depth:
            number, self._pending = self._pending, 0
            raise _interruption(number)

    def _received(self, number: int, frame: FrameType | None) -> None:
        if self._depth:
            self._pending = number
        elif _imports(frame) > self._outside:
            again = threading.Timer(IMPORT_WAIT, _thread.interrupt_main, (number,))
            again.daemon = True
            again.start()
        else:
            raise _interruption(number)


def _imports(frame: FrameType | None) -> int:
    """How many frames of Python's import a frame is called from: above 0 while a module is imported."""
    count = 0
    while frame is not None:
        count += frame.f_code.co_filename == IMPORTING
        frame = frame.f_back
    return count


def _interruption(number: int) -> KeyboardInterrupt:
    return Terminated() if number == signal.SIGTERM else KeyboardInterrupt()
