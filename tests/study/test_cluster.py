"""Sweeps on a Dask cluster that somebody else has started."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from press import CASE, LAW, written

import prensa as pr
from prensa.errors import PrensaError
from prensa.study.results import CASES_TABLE

UNSEEN = "unseen"
BLINDFOLD = f"""\
import sys

def refuse(event, arguments):
    if event == "open" and "/{UNSEEN}/" in str(arguments[0]):
        raise FileNotFoundError(arguments[0])

sys.addaudithook(refuse)
"""
MESH = """\
*NODE
1, 0, 0
2, 1, 0
3, 2, 0
4, 0, 1
5, 1, 1
6, 2, 1
*ELEMENT, TYPE=CPE4
1, 1, 2, 5, 4
2, 2, 3, 6, 5
*NSET, NSET=top
4, 5, 6
*NSET, NSET=bottom
1, 2, 3
*NSET, NSET=left
1, 4
"""


@contextmanager
def cluster(folder: Path, workers: int = 2) -> Iterator[Path]:
    """A scheduler and workers of one thread, started as a user would, in a folder of their own; yields the scheduler file."""
    folder.mkdir()
    where = folder / "scheduler.json"
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
    plain = ["--no-dashboard", "--scheduler-file", str(where)]
    started = [[sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *plain]]
    (folder / "blindfold.py").write_text(BLINDFOLD, encoding="utf-8")
    started += [
        [sys.executable, "-m", "distributed.cli.dask_worker", *plain, "--nthreads", "1", "--host", "127.0.0.1",
         "--memory-limit", "1GiB", "--preload", str(folder / "blindfold.py"), "--local-directory", str(folder / f"local{k}")]
        for k in range(workers)
    ]  # fmt: skip
    processes = []
    try:
        for command in started:
            processes.append(
                subprocess.Popen(command, cwd=folder, env=clean, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            )
            deadline = time.monotonic() + 60
            while not where.is_file() and time.monotonic() < deadline:
                time.sleep(0.05)
        yield where
    finally:
        for process in reversed(processes):
            process.terminate()
        for process in processes:
            process.wait(30)


@pytest.mark.slow
def test_a_cluster_started_elsewhere_computes_the_same(tmp_path: Path) -> None:
    """Two workers over TCP, started in another folder: the table is byte for byte that of one process.

    Of a second study they see neither the case's files nor the folder of the results: mesh and law are sent to them, and what
    they compute comes back.
    """
    pytest.importorskip("distributed")
    text = CASE.replace("type: ludwik", "type: 'deadly:Deadly'")
    text = text.replace("{type: rectangle, size: [2, 1], n: [4, 2]}", "{type: file, path: block.inp}")
    values, measures = {"friction.mu": [0, 0.2]}, ["end(punch.fy, down)"]
    folders = [tmp_path / "seen", tmp_path / UNSEEN]
    for folder in folders:
        folder.mkdir()
        (folder / "deadly.py").write_text(LAW, encoding="utf-8")
        (folder / "block.inp").write_text(MESH, encoding="utf-8")
        written(folder, text=text)
    alone = pr.sweep(folders[0] / "press.yaml", values, measures, out=tmp_path / "alone", jobs=1, quiet=True)
    assert alone.status == {"completed": 2}
    with cluster(tmp_path / "there") as where:
        studies = [
            pr.sweep(f / "press.yaml", values, measures, out=f / "out", cluster=where, quiet=True) for f in folders
        ]
    for study in studies:
        assert (study.directory / CASES_TABLE).read_bytes() == (alone.directory / CASES_TABLE).read_bytes()
        for row in alone.rows:
            for name in ("history.csv", "case.json", "fields/0005.vtu"):
                file = f"{row.folder}/{name}"
                assert (study.directory / file).read_bytes() == (alone.directory / file).read_bytes()
        workers = {line.split(",")[3] for line in (study.directory / "timings.csv").read_text().splitlines()[1:]}
        assert f":{os.getpid()}" not in "".join(workers)
    assert str(tmp_path / UNSEEN) not in (studies[1].directory / alone.rows[0].folder / "summary.json").read_text()
    with pytest.raises(PrensaError, match="no scheduler file"):  # it has been ended
        pr.sweep(folders[0] / "press.yaml", values, measures, out=tmp_path / "late", cluster=where, quiet=True)
    assert not (tmp_path / "late").exists()
