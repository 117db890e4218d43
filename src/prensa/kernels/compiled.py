"""The decorator of every kernel: compiled when first called, kept on the disk where there is a place for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """``numba.njit`` that does without its cache where neither the package nor the user's cache folder can be written.

    Numba refuses to define such a function, so that a package in a read-only place could not even be imported.
    """

    def kernel(function: Callable[..., Any]) -> Any:
        try:
            return numba.njit(**options)(function)
        except RuntimeError:  # no place for the cache; anything else is raised again below
            return numba.njit(**options | {"cache": False})(function)

    return kernel
