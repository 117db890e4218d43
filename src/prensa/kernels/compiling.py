"""Say that kernels are being compiled: the first run after an installation waits for that, and should know what for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

from prensa.kernels import machine_code

LINE = "compiling kernels; this happens once, later runs find them on the disk"


class _Listener(event.Listener):
    def __init__(self, say: Callable[[str], None]) -> None:
        self.say: Callable[[str], None] | None = say

    def on_start(self, event: Any) -> None:
        """A function is compiled (one that is found in the cache sends nothing)."""
        if event.data["dispatcher"].py_func.__module__.startswith("prensa."):
            self.once()

    def once(self) -> None:
        """Say the line, if it has not been said."""
        if self.say is not None:
            self.say(LINE)
            self.say = None

    def on_end(self, event: Any) -> None:
        """Nothing: one line is enough."""


@contextmanager
def announced(say: Callable[[str], None]) -> Iterator[None]:
    """Inside the block, the first kernel that has to be compiled is announced with one line to *say*."""
    listener = _Listener(say)
    machine_code.listeners.append(listener.once)
    try:
        with event.install_listener("numba:compile", listener):
            yield
    finally:
        machine_code.listeners.remove(listener.once)
