"""The line that says why the first run after an installation takes its time."""

from __future__ import annotations

from numba import njit

from prensa.kernels.compiling import LINE, announced


def kernel(module: str):
    def twice(x):
        return 2.0 * x

    twice.__module__ = module
    return njit(twice)


def test_compiling_a_kernel_is_said_once_and_a_compiled_one_says_nothing():
    """One line for the first of prensa's kernels; none for other packages', none when everything is there."""
    said: list[str] = []
    first, second = kernel("prensa.one"), kernel("prensa.two")
    with announced(said.append):
        kernel("elsewhere")(1.0)
        assert said == []
        first(1.0), second(1.0)
    assert said == [LINE]
    with announced(said.append):
        first(2.0)
    assert said == [LINE]
