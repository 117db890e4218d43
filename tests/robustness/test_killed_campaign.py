"""The campaign of killed runs judges right ones right, and finds what does not go on."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from prensa_bench import killed

pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes are forked and killed by their signals")


@pytest.mark.slow
@pytest.mark.parametrize("kind", killed.SUBJECTS)
def test_runs_are_seen_and_continued(kind: str, tmp_path: Path) -> None:
    tally = killed.judged(kind, 2, 11, tmp_path)
    assert tally.signals.total() == 2 and tally.wrong == []


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
