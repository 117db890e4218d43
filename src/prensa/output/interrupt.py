"""Ctrl-C stops the solver at once and a writer never: a file being written is finished first."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any


class Interruptible:
    """Context manager that replaces the handler of SIGINT; does nothing outside the main thread.

    Inside ``with guard.postponed():`` a Ctrl-C waits for the end of the block and then raises KeyboardInterrupt.
    """

    def __init__(self) -> None:
        self._depth, self._pending = 0, False
        self._previous: Any = None

    def __enter__(self) -> Interruptible:
        if threading.current_thread() is threading.main_thread():
            self._previous = signal.signal(signal.SIGINT, self._received)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    @contextmanager
    def postponed(self) -> Iterator[None]:
        """Hold Ctrl-C back until the block is done; an error of the block goes first."""
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
        if self._pending and not self._depth:
            self._pending = False
            raise KeyboardInterrupt

    def _received(self, number: int, frame: FrameType | None) -> None:
        if not self._depth:
            raise KeyboardInterrupt
        self._pending = True
