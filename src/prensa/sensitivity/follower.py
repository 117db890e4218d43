"""A thread that finds the derivatives of increments while the run goes on to the next ones."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait

from prensa.errors import PrensaError, SolveError
from prensa.linear.threads import ONE_OF_BLAS
from prensa.result.increment import Increment
from prensa.sensitivity.increments import Derived
from prensa.solver.reporting import Messages
from prensa.timer import Timer


class Follower:
    """Increments of which the derivatives are looked for by another thread, in their order.

    Nothing of the run depends on them, and they depend on nothing that the run still changes: they are the same bit for bit as
    without.
    """

    def __init__(self, messages: Messages, timer: Timer) -> None:
        self.messages, self.timer = messages, timer
        self._pool = ThreadPoolExecutor(1, "derivatives")
        self._behind: deque[tuple[Increment, Future[Derived]]] = deque()

    def follow(self, increment: Increment, find: Callable[[], Derived]) -> None:
        """Let the derivatives of an increment be found, after those of the increments before."""
        self._behind.append((increment, self._pool.submit(_found, find)))

    def wait(self) -> None:
        """Until those of all increments up to now are found."""
        wait([found for _, found in self._behind])

    def behind(self, increments: Iterator[Increment]) -> Iterator[Increment]:
        """The increments of a run with their derivatives, each once the next one is solved, or will not be.

        Errors come in the order in which they would without another thread.
        """
        error: PrensaError | None = None
        try:
            while True:
                try:
                    solved = next(increments, None)
                except PrensaError as reason:
                    error = reason
                    break
                if solved is None:
                    break
                while len(self._behind) > 1:
                    yield self._next()
            while self._behind:
                first, last = self._behind[0][0], self._next()
                if isinstance(error, SolveError) and error.last is first:
                    error.last = last
                yield last
            if error is not None:
                raise error
        finally:
            # Who stops asking does not wait for what is still queued.
            self._pool.shutdown(cancel_futures=True)

    def _next(self) -> Increment:
        """The increment that is furthest behind; the time for which it is waited for is that of derivatives."""
        increment, finding = self._behind.popleft()
        with self.timer("derivatives"):
            found = finding.result()
        self.messages.warn(found.doubts)
        return found.of(increment)


def _found(find: Callable[[], Derived]) -> Derived:
    # With dense products by several threads the last bits would depend on which of the two threads came first.
    with ONE_OF_BLAS:
        return find()
