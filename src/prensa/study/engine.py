"""Engines of a study: its cases are computed in this process, in processes of this machine, or on a Dask cluster.

Whether an engine can be had is known as soon as it is made; what it computes comes back in the order in which it is finished.
Dask (the extra ``prensa[dask]``) starts and watches the processes, keeps their memory, and gives the cases of a worker that was
killed to another.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from prensa import __version__
from prensa.errors import PrensaError
from prensa.study.attachments import Attachment
from prensa.study.work import Job, Outcome, compute

IN_WAITING = 3  # cases handed out for each worker: it need not wait for the next, and this process's memory stays small
TRIES = 2  # of a case whose workers are killed
CONNECT = 10  # s, to a scheduler and for a first worker to be there


class Engine(Protocol):
    """Computes jobs; ``summary``: itself in a line, ``workers``: how many cases it computes at the same time."""

    summary: str
    workers: int

    def outcomes(self, jobs: Iterator[Job]) -> Iterator[tuple[Job, Outcome]]:
        """Jobs with what became of them, as they are finished; *jobs* is asked for the next one when there is room."""
        ...


class Here:
    """One case after the other in this process."""

    summary, workers = "one case after the other in this process", 1

    def outcomes(self, jobs: Iterator[Job]) -> Iterator[tuple[Job, Outcome]]:
        """Jobs with what became of them."""
        for job in jobs:
            yield job, compute(job)


class OnDask:
    """The workers of a Dask client."""

    def __init__(self, client: Any, summary: str, workers: int, sent: bool) -> None:
        self._client, self.summary, self.workers = client, summary, workers
        self._compute: Callable[[Job], Outcome] = compute
        if sent:
            from prensa.study.plugin import compute_with_files

            self._compute = compute_with_files

    def outcomes(self, jobs: Iterator[Job]) -> Iterator[tuple[Job, Outcome]]:
        """Jobs with what became of them; those that waited on a cluster that went away are not among them.

        Raises
        ------
        PrensaError
            If the cluster goes away.

        """
        from distributed import as_completed

        running: dict[Any, Job] = {}
        finished = as_completed()

        def hand_out() -> None:
            while len(running) < IN_WAITING * self.workers and (job := next(jobs, None)) is not None:
                # By the key of the case, so that nothing is computed twice; not pure and without retries of Dask's, whose
                # failed cases are kept apart from lost ones here.
                future = self._client.submit(self._compute, job, key=f"case-{job.key}", pure=False, retries=0)
                running[future] = job
                finished.add(future)

        hand_out()
        while running:
            future = next(finished)
            job = running.pop(future)
            outcome = self._outcome(future)
            future.release()
            hand_out()
            yield job, outcome

    def _outcome(self, future: Any) -> Outcome:
        from distributed import CancelledError, KilledWorker

        try:
            result = future.result()
        except KilledWorker:
            return Outcome(
                "lost", f"its workers were killed, time and again; they are {self.summary}: does it need more memory?"
            )
        except (CancelledError, OSError) as error:
            message = "the cluster has gone; what is finished is kept: give the same command again when it is back"
            raise PrensaError(message) from error
        except Exception as error:  # raised by Dask: what the case raises is in its outcome
            return Outcome("lost", f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}")
        assert isinstance(result, Outcome)
        return result


@contextmanager
def engine(
    jobs: int | None, memory: str | None, cluster: str | Path | None, attachments: tuple[Attachment, ...]
) -> Iterator[Engine]:
    """The engine that is asked for.

    Parameters
    ----------
    jobs
        Processes of this machine, one a core if None, or none without Dask; with 1 no process is started and Dask is not needed.
    memory
        Of each process, such as ``2 GB``; shared out if None.
    cluster
        Address of the scheduler of a Dask cluster, or its scheduler file.
    attachments
        Files that the cases need, which are sent to workers that do not see them.

    Raises
    ------
    PrensaError
        If Dask is not installed, the cluster is not there or its workers cannot compute.

    """
    # A spawned worker imports the script that started the study: unguarded it would start the study again, in every worker.
    if multiprocessing.parent_process() is not None:
        message = "this is a worker process that imports the script which starts the study; put the call of"
        raise PrensaError(f"{message} prensa.sweep under \"if __name__ == '__main__':\"")
    if cluster is not None:
        if jobs is not None or memory is not None:
            raise PrensaError("a cluster has its own processes and memory; leave --jobs and --memory out")
        with _remote(str(cluster), attachments) as found:
            yield found
        return
    count = jobs or available_cores()
    if jobs is None and memory is None and count > 1 and find_spec("distributed") is None:
        found = Here()
        found.summary += f", since several processes need Dask: pip install prensa[dask] for {count} at once"
        yield found
        return
    if count == 1 and memory is None:
        yield Here()
        return
    with _local(count, memory) as found:
        yield found


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# ------------------------------------------------------------------------------------------------------- this machine
@contextmanager
def _local(count: int, memory: str | None) -> Iterator[Engine]:
    _need_dask()
    from dask.config import set as configured
    from distributed import Client, LocalCluster
    from distributed.system import MEMORY_LIMIT

    # Not concurrent.futures or joblib: one process that is killed breaks their whole pool.
    each = _bytes(memory, MEMORY_LIMIT) if memory else int(MEMORY_LIMIT / count)
    with _dask_settings(configured), tempfile.TemporaryDirectory(prefix="prensa-dask-") as here:
        try:
            cluster = LocalCluster(
                n_workers=count, threads_per_worker=1, processes=True, memory_limit=each, host="127.0.0.1",
                dashboard_address="127.0.0.1:0", local_directory=here, silence_logs=logging.CRITICAL,
            )  # fmt: skip
        except (OSError, RuntimeError, TimeoutError) as error:
            raise PrensaError(f"{count} worker processes could not be started ({error}); try --jobs 1") from error
        with cluster, Client(cluster) as client:
            summary = f"{count} process{'es' if count > 1 else ''} of one thread and {each / 2**30:.2g} GiB each"
            yield OnDask(client, summary, count, sent=False)


def _dask_settings(configured: Any) -> Any:
    """Cases whose workers die are given to others a few times; a worker is ended when it is nearly out of its memory."""
    return configured(
        {
            "distributed.scheduler.allowed-failures": TRIES - 1,
            "distributed.scheduler.worker-saturation": 1.0,  # cases that wait are not counted as killed with the running one
            "distributed.worker.memory.target": False,  # results are small and stay in memory
            "distributed.worker.memory.spill": False,
            "distributed.worker.memory.pause": False,
            "distributed.comm.timeouts.connect": f"{CONNECT}s",
        }
    )


def _bytes(memory: str, most: float) -> int:
    from dask.utils import parse_bytes

    try:
        found = int(parse_bytes(memory))
    except ValueError:
        raise PrensaError(f"{memory!r} is not an amount of memory; give one such as 2GB or 500MB") from None
    if found < 200_000_000:
        raise PrensaError(f"{memory} of memory for each worker; a process alone takes 200 MB, give more")
    if found > most:
        raise PrensaError(f"{memory} of memory for each worker; this machine has {most / 1e9:.3g} GB")
    return found


def _need_dask() -> None:
    try:
        import distributed  # noqa: F401
    except ImportError:
        message = "several processes and clusters need Dask, which is not installed: pip install prensa[dask]"
        raise PrensaError(f"{message}; or compute one case after the other with --jobs 1") from None


# ------------------------------------------------------------------------------------------------------------ a cluster
@contextmanager
def _remote(where: str, attachments: tuple[Attachment, ...]) -> Iterator[Engine]:
    _need_dask()
    from dask.config import set as configured

    with _dask_settings(configured), _quiet_dask():
        client = _client(where)
        with client:
            workers = _workers(client, where)
            if attachments:
                from prensa.study.plugin import Files

                client.register_plugin(Files(attachments))
            threads = sum(w["nthreads"] for w in workers)
            memories = {w["memory_limit"] for w in workers}
            each = f"{min(memories) / 2**30:.2g} GiB each" if min(memories) else "no limit of memory"
            summary = f"{len(workers)} worker{'s' if len(workers) > 1 else ''} with {each}"
            if threads > len(workers):
                summary += ", which compute one case at a time: start more of them with --nthreads 1"
            yield OnDask(client, summary, len(workers), sent=bool(attachments))


@contextmanager
def _quiet_dask() -> Iterator[None]:
    """Silence what Dask logs about connections: our own messages report it."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client", "distributed.comm")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels):
            logger.setLevel(level)


def _client(where: str) -> Any:
    from distributed import Client

    path = Path(where)
    is_file = path.suffix == ".json" or path.is_file()
    if is_file and not path.is_file():
        raise PrensaError(f"there is no scheduler file {where!r}; the cluster writes it when it starts")
    if not is_file and not where.rpartition(":")[2].isdecimal():
        raise PrensaError(f"--cluster {where}: give an address such as tcp://10.0.0.1:8786, or a scheduler file")
    try:
        return Client(scheduler_file=str(path), timeout=CONNECT) if is_file else Client(where, timeout=CONNECT)
    except (OSError, TimeoutError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise PrensaError(f"there is no Dask cluster at {where} ({reason}); start one with 'dask scheduler'") from error


def _workers(client: Any, where: str) -> list[dict[str, Any]]:
    """Descriptions of the workers, all of which have this version of prensa."""
    with suppress(TimeoutError, OSError):
        client.wait_for_workers(1, timeout=CONNECT)
    workers = list(client.scheduler_info(n_workers=-1)["workers"].values())
    if not workers:
        raise PrensaError(f"the cluster at {where} has no workers; start some with 'dask worker {where} --nthreads 1'")
    try:
        versions = client.run(_version)
    except Exception as error:
        raise PrensaError(
            f"the workers of {where} cannot import prensa ({error}); install prensa {__version__}"
        ) from None
    other = {v for v in versions.values() if v != __version__}
    if other:
        message = f"workers of {where} have prensa {', '.join(sorted(other))}, here it is {__version__}"
        raise PrensaError(f"{message}; install the same version")
    return workers


def _version() -> str:
    return __version__
