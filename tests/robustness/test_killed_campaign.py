"""The campaign of killed runs judges right ones right, and finds what does not go on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from prensa_bench import killed

pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes are forked and killed by their signals")


@pytest.mark.slow
@pytest.mark.parametrize("kind", killed.SUBJECTS)
def test_runs_are_seen_and_continued(kind: str) -> None:
    """In a process of its own: it forks, and threads of one that has solved something do not survive that."""
    code = f"from prensa_bench.killed import killed; t, = killed([{kind!r}], 2, 11, print); print(t.signals.total(), t.wrong)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "2 []", done.stdout


def test_what_is_wrong_is_found(tmp_path: Path) -> None:
    """A run that begins again writes what was kept once more, and one that ends otherwise has other bytes."""

    def go(folder: Path) -> None:
        folder.mkdir(exist_ok=True)
        for name in ("a", "b"):
            (folder / name).write_text(f"{os.getpid()}")  # of each process another

    def kept(folder: Path) -> dict[str, int]:
        return {p.name: p.stat().st_mtime_ns for p in folder.glob("a")}

    subject = killed.Subject(go, lambda folder: [], kept, lambda folder: {p.name: p.read_bytes() for p in folder.glob("*")})
    killed._forked(go, tmp_path / "whole")
    _, status = killed._forked(go, tmp_path / "here", at=3, send=int(signal.SIGKILL))
    assert os.WTERMSIG(status) == signal.SIGKILL and not (tmp_path / "here" / "b").exists()
    found = killed._continued(subject, tmp_path / "here", subject.made(tmp_path / "whole"))
    assert found == ["a was computed again", "a differs", "b differs"]
