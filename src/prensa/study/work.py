"""One case of a study, computed where a worker is: continued where it was interrupted, its failure reported and not fatal."""

from __future__ import annotations

import io
import json
import os
import shutil
import tempfile
import threading
import time as clocks
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from prensa import __version__
from prensa.errors import PrensaError, SolveError
from prensa.model.problem import Case
from prensa.output.files import write_text
from prensa.output.lock import LOCK, FolderInUse
from prensa.output.progress import ProgressBar
from prensa.study.attachments import Attachment, attached, places
from prensa.study.quantities import Quantity, series_of, values_of
from prensa.study.slopes import Slopes, slopes_of
from prensa.system.checkpoint import CHECKPOINT, seal_broken, text_hash

RECORD = "case.json"
_ONE_AT_A_TIME = threading.Lock()  # logs, warnings and solvers are a process's
_POLL = 0.5  # s


@dataclass(frozen=True)
class Job:
    """A case to compute.

    ``key``: hash of the case and of the version of prensa; ``text``: the case with its files detached; ``folder``: where its
    results belong; ``wanted``: what to take from it; ``claim``: what the lock of the study's folder says, by which a worker
    knows that it sees that folder; ``derivatives``: paths by which those of what is wanted are, too.
    """

    key: str
    text: str
    folder: str
    wanted: tuple[Quantity, ...] = ()
    attachments: tuple[Attachment, ...] = ()
    claim: str = ""
    derivatives: tuple[str, ...] = ()


@dataclass
class Outcome:
    """What became of a job: ``completed``, ``failed`` (the case's own doing, which would be the same again) or ``lost``.

    ``seconds``: wall time of the run; ``files``: the results, zipped, of a worker that does not see the folder; ``measures``:
    columns of the table of measures, and what they are; ``values``: what was wanted, by its text; ``slopes``: derivatives of
    that by text and path, and ``unsloped``: why there are none, by text.
    """

    status: str
    reason: str = ""
    seconds: float = 0.0
    worker: str = ""
    files: bytes | None = field(default=None, repr=False)
    measures: dict[str, str] = field(default_factory=dict)
    values: dict[str, float | None] = field(default_factory=dict)
    slopes: Slopes = field(default_factory=dict)
    unsloped: dict[str, str] = field(default_factory=dict)


def key_of(text: str) -> str:
    """Key of a case by its detached text: the same case of the same version of prensa has the same."""
    # By content: values that were changed do not show that a mesh file was, and numbers of cases shift.
    return text_hash(f"prensa {__version__}\n{text}")


def read_record(folder: Path, key: str) -> dict[str, Any] | None:
    """What the folder of a case says of it, None if the case has not been computed to its end there."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return record if isinstance(record, dict) and record.get("key") == key else None


def compute(job: Job, sent: str | None = None) -> Outcome:
    """Compute a job, or take up what an interrupted worker left of it; *sent*: where files have been sent to.

    Returns rather than raises whatever goes wrong in the case.
    """
    with _ONE_AT_A_TIME:
        began = clocks.perf_counter()
        try:
            outcome = _computed(job, Path(sent) if sent else None)
        except MemoryError as error:
            outcome = Outcome("lost", f"out of memory ({error})")
        except PrensaError as error:
            outcome = Outcome("lost", _one_line(str(error)))
        except Exception as error:  # a defect of a user's law, a full disk: the other cases go on
            outcome = Outcome("lost", _one_line(f"{type(error).__name__}: {error}"))
        outcome.seconds = clocks.perf_counter() - began
        outcome.worker = f"{os.uname().nodename if hasattr(os, 'uname') else ''}:{os.getpid()}"
        return outcome


def _computed(job: Job, sent: Path | None) -> Outcome:
    folder = Path(job.folder)
    if _sees(folder, job.claim):
        return _in(folder, job, sent)
    with tempfile.TemporaryDirectory(prefix="prensa-") as here:
        folder = Path(here) / "case"
        outcome = _in(folder, job, sent)
        outcome.files = packed(folder)
    return outcome


def _sees(folder: Path, claim: str) -> bool:
    """Whether this process sees the folder of the study: its lock says the same here."""
    if not claim:
        return True
    try:
        return (folder.parents[1] / LOCK).read_text(encoding="utf-8") == claim
    except OSError:
        return False


def _in(folder: Path, job: Job, sent: Path | None) -> Outcome:
    """Compute in *folder*; waits while a process that is about to end still writes there."""
    while True:
        record = read_record(folder, job.key)
        if record is not None:
            return Outcome(record["status"], record["reason"])
        try:
            outcome = _run(folder, job, sent)
        except FolderInUse:
            clocks.sleep(_POLL)
            continue
        # A lost case may succeed elsewhere, so that nothing is recorded of it; a failed one is the case's own doing, and stays.
        if outcome.status != "lost":
            record = {"key": job.key, "version": __version__, "status": outcome.status, "reason": outcome.reason}
            record |= {"measures": outcome.measures, "values": outcome.values}
            if job.derivatives:
                record |= {"slopes": outcome.slopes, "unsloped": outcome.unsloped}
            write_text(folder / RECORD, json.dumps(record, indent=1, ensure_ascii=False) + "\n")
        return outcome


class _Silent(ProgressBar):
    """Shows nothing: warnings are in the summary of the run, and on the page of the study."""

    def __init__(self) -> None:
        super().__init__(quiet=True)

    def warn(self, text: str) -> None:
        """Leave the terminal to the study."""


def _run(folder: Path, job: Job, sent: Path | None) -> Outcome:
    from prensa.model.schema import loads
    from prensa.output.checkpoint import case_text
    from prensa.output.run import resume, run

    case = loads(attached(job.text, places(job.attachments, sent)), bounded=False)
    try:
        # A restart gives the same bits as a run without interruption: the table does not show which cases were interrupted.
        if _was_interrupted(folder, case_text(case)):
            try:
                resume(folder, bar=_Silent())
                return _completed(folder, job, case)
            except (FolderInUse, SolveError):
                raise
            except PrensaError:  # what was left is damaged
                pass
        run(case, out=folder, force=True, bar=_Silent())
    except FolderInUse:
        raise
    except PrensaError as error:
        folder.mkdir(parents=True, exist_ok=True)
        return Outcome("failed", _one_line(str(error)))
    return _completed(folder, job, case)


def _completed(folder: Path, job: Job, case: Case) -> Outcome:
    names = dict(case.problem.measures)
    found = Outcome("completed", measures=names, values=values_of(job.wanted, series_of(folder, names)))
    if job.derivatives:
        try:
            found.slopes, found.unsloped = slopes_of(case, job.wanted, job.derivatives)
        except PrensaError as error:  # the run stands without them
            reason = _one_line(str(error)).removeprefix("derivatives: ")
            found.unsloped = dict.fromkeys((q.text for q in job.wanted), reason)
    return found


def _was_interrupted(folder: Path, text: str) -> bool:
    """Whether *folder* holds a checkpoint of just this case."""
    import h5py

    try:
        if seal_broken(folder / CHECKPOINT):
            return False
        with h5py.File(folder / CHECKPOINT, "r") as file:
            return bool(file.attrs["input_hash"] == text_hash(text) and file.attrs["prensa"] == __version__)
    except (OSError, KeyError):
        return False


def _one_line(text: str) -> str:
    return "; ".join(line.strip() for line in text.splitlines() if line.strip())


# -------------------------------------------------------------------------------------- results that have to be sent home
def packed(folder: Path) -> bytes:
    """The files below *folder*, zipped."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.name != LOCK:
                archive.write(path, path.relative_to(folder).as_posix())
    return buffer.getvalue()


def unpacked(files: bytes, folder: Path) -> None:
    """Put zipped results in place of *folder*."""
    # Unpacked beside and moved in one step: an interruption leaves the old results or the new ones, no mixture.
    fresh = folder.with_name(folder.name + ".part")
    shutil.rmtree(fresh, ignore_errors=True)
    with zipfile.ZipFile(io.BytesIO(files)) as archive:
        archive.extractall(fresh)
    shutil.rmtree(folder, ignore_errors=True)
    fresh.rename(folder)
