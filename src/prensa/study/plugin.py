"""Brings the files that the cases need to the workers of a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from distributed import WorkerPlugin, get_worker

from prensa.study.attachments import Attachment
from prensa.study.work import Job, Outcome, compute


class Files(WorkerPlugin):
    """Writes the content of attachments into the folder of every worker, those that come later too."""

    name = "prensa files"

    def __init__(self, attachments: tuple[Attachment, ...]) -> None:
        self._contents = {f"{one.digest}/{one.name}": Path(one.origin).read_bytes() for one in attachments}

    def setup(self, worker: Any) -> None:
        """Write them."""
        for name, content in self._contents.items():
            path = _sent_to(worker) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


def compute_with_files(job: Job) -> Outcome:
    """`compute` on a worker to which files have been sent."""
    return compute(job, str(_sent_to(get_worker())))


def _sent_to(worker: Any) -> Path:
    return Path(worker.local_directory) / "prensa-files"
