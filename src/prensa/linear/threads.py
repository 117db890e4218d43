"""Number of threads of a run: those asked for or, with ``auto``, one for every core that nothing else uses.

Results do not depend on it: chunks of elements are the same whoever answers for them, and are added up in their order. Of small
dense products NumPy's threads make nothing faster, but they stay awake beside those that factor matrices, and take their cores.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from pathlib import Path
from typing import Any

from prensa.linear.factorisations import available, may_be_detached
from prensa.model import problem as model
from prensa.policy import DEFAULT, Policy

LOAD = Path("/proc/loadavg")


def threads_of(numerics: model.Numerics, unknowns: int, policy: Policy = DEFAULT) -> int:
    """Threads for a problem with so many unknowns.

    ``auto`` takes one for small problems, under pytest, and in a process that another one of Python has started: whoever starts
    several has shared out the cores. It takes no more than OMP_NUM_THREADS, where that is set.
    """
    if numerics.threads != "auto":
        return numerics.threads
    return 1 if unknowns < policy.threads_from_dofs else _free_threads(policy)


def threads_with_follower(
    numerics: model.Numerics, unknowns: int, policy: Policy = DEFAULT, spatial: bool = False
) -> tuple[int, bool]:  # fmt: skip
    """Threads for a run with derivatives, and whether one more is to find these while the run goes on.

    That is one of those asked for, or that are free. Not of small problems, where the two would wait for Python's lock; not of
    those whose factors of two increments would need too much memory; nor where a solver's later factors take the place of those
    that are at hand; nor in space (``spatial``), where a hierarchy of multigrid has room for one thread.
    """
    if spatial or unknowns < policy.pipeline_from_dofs or not may_be_detached(available(numerics.solver), unknowns, policy):
        return threads_of(numerics, unknowns, policy), False
    threads = _free_threads(policy) if numerics.threads == "auto" else numerics.threads
    # The follower takes one of the threads, of which small problems had only one for themselves.
    own = threads - 1 if numerics.threads != "auto" or unknowns >= policy.threads_from_dofs else 1
    return (own, True) if threads > 1 else (1, False)


def _free_threads(policy: Policy) -> int:
    """As many as there are cores for them: see `threads_of`."""
    if os.environ.get("PYTEST_CURRENT_TEST") is not None or multiprocessing.parent_process() is not None:
        return 1
    most = policy.max_auto_threads
    given = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0]
    if given.isdigit() and int(given) > 0:
        most = min(most, int(given))
    return max(1, min(most, free_cores())) if most > 1 else 1


class _Blas:
    """OpenBLAS and BLIS with one thread as long as somebody is inside; MKL, which may factor matrices, takes what it takes.

    Runs in several threads of Python set one and the same number for the process: the last one that leaves sets it back.
    """

    def __init__(self) -> None:
        self._lock, self._inside = threading.Lock(), 0
        self._libraries: Any = None
        self._limited: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if self._libraries is None:
                from threadpoolctl import ThreadpoolController

                self._libraries = ThreadpoolController().select(internal_api=["openblas", "blis"])
            if not self._inside:
                self._take_over()
                self._limited = self._libraries.limit(limits=1)
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside:
                self._take_over()
                self._limited.restore_original_limits()
                self._take_over()

    def _take_over(self) -> None:
        """Let whoever comes next set the number: threadpoolctl from 3.8 on else leaves it, without a word, to who did first."""
        for library in self._libraries.lib_controllers:
            if hasattr(library, "clear_controlling_thread"):
                library.clear_controlling_thread(force=True)


ONE_OF_BLAS = _Blas()
"""Within this NumPy's dense products take one thread."""


def free_cores() -> int:
    """Cores that this process may use and on which nothing runs now."""
    may = getattr(os, "sched_getaffinity", None)
    cores = len(may(0)) if may else os.cpu_count() or 1
    return cores - busy()


def busy() -> int:
    """Threads of other processes that run or wait for a core; 0 where the system does not say."""
    if not LOAD.exists():
        return 0
    # Not the load average: it remembers the last minute, in which the same script may have solved the case before.
    seen = []
    for _ in range(5):  # one look could fall on a moment when something wakes up
        # Who reads the number of running threads is one of them.
        seen.append(int(LOAD.read_text().split()[3].partition("/")[0]) - 1)
        time.sleep(0.002)
    return max(sorted(seen)[len(seen) // 2], 0)
