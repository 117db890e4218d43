"""Handlers of signals that survive foreign code: MMG leaves the system's defaults behind, by which Ctrl-C ends a process."""

from __future__ import annotations

import ctypes
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

HANDLED = ("SIGINT", "SIGTERM", "SIGABRT", "SIGFPE", "SIGILL", "SIGSEGV", "SIGBUS")
"""Signals whose handlers MMG replaces."""
WAITING = (signal.SIGINT, signal.SIGTERM)
"""Those that users and systems send, which wait for the end of a mesh."""
ROOM = 512
"""Bytes for a ``struct sigaction``, which no system makes larger than 152."""


@contextmanager
def kept() -> Iterator[None]:
    """Put all handlers of signals back after a block, whoever replaced them, in any thread.

    SIGINT and SIGTERM wait for the end of the block: a handler of the foreign code would end the process meanwhile.
    """
    numbers = [int(getattr(signal, name)) for name in HANDLED if hasattr(signal, name)]
    if os.name == "posix":
        # Python's own functions would restore its handlers alone, in the main thread alone
        sigaction = ctypes.CDLL(None).sigaction
        actions = {number: ctypes.create_string_buffer(ROOM) for number in numbers}
        for number, action in actions.items():
            sigaction(number, None, action)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, WAITING)
        try:
            yield
        finally:
            for number, action in actions.items():
                sigaction(number, action, None)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return
    handlers = {number: signal.getsignal(number) for number in numbers}
    try:
        yield
    finally:
        if threading.current_thread() is threading.main_thread():
            for number, handler in handlers.items():
                if handler is not None:
                    signal.signal(number, handler)
