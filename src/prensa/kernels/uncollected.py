"""No search for cyclic garbage while a kernel is made: it finds next to none, and what is made is many small objects."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_lock = threading.Lock()
_depth = 0
_collecting = False


def begin() -> None:
    """Kernels are made until `end`, in this thread or another, of their own or within others."""
    global _depth, _collecting
    with _lock:
        if _depth == 0:
            _collecting = gc.isenabled()
            gc.disable()
        _depth += 1


def end() -> None:
    """What the last `begin` announced is done; after the outermost, garbage is collected as before."""
    global _depth
    with _lock:
        _depth -= 1
        if _depth == 0 and _collecting:
            gc.enable()


@contextmanager
def uncollected() -> Iterator[None]:
    """`begin` and `end`, whatever happens between them."""
    begin()
    try:
        yield
    finally:
        end()
