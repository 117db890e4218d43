"""The decorator of every kernel: compiled when first called, kept on the disk where there is a place for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import event

from prensa.kernels import uncollected


class _Uncollected(event.Listener):
    """Of Numba's kernels, which take a sixth longer otherwise."""

    def on_start(self, event: Any) -> None:
        """A kernel begins to be compiled, of its own or within another."""
        uncollected.begin()

    def on_end(self, event: Any) -> None:
        """It has been."""
        uncollected.end()


event.register("numba:compile", _Uncollected())


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """``numba.njit`` that lets other threads run meanwhile, and does without its cache where there is no place for it.

    What is inlined by force and has a name with an underscore is called by kernels alone: the wrapper with which Python calls
    it, a fifth of its compilation, is left out. Python must not call it.

    That is where neither the package nor the user's cache folder can be written: Numba refuses to define such a function, so that
    a package in a read-only place could not even be imported.
    """

    def kernel(function: Callable[..., Any]) -> Any:
        within = bool(options.get("forceinline")) and function.__name__.startswith("_")
        # Numba's own inlining ('always') takes longer than to compile the functions, and LLVM has one level for the whole
        # process.
        own = {"nogil": True, "no_cfunc_wrapper": True, "no_cpython_wrapper": within} | options
        try:
            return numba.njit(**own)(function)
        except RuntimeError:  # no place for the cache; anything else is raised again below
            return numba.njit(**own | {"cache": False})(function)

    return kernel
