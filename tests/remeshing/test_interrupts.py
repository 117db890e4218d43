"""Ctrl-C after the mesher was called: MMG replaces the handlers of signals by the system's, which would end the process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

RUN = """
import os, signal, threading
import prensa as pr

def meshed_anew():
    size = pr.Sizes(far=1.0)
    metal = pr.J2(70e3, 0.33, pr.Swift(K=200.0, e0=0.01, n=0.2))
    return pr.Problem(
        "billet", {"b": pr.Body(pr.Rectangle((6.0, 6.0), (6, 6)), metal, "t6")},
        (pr.Step("press", move={"t": pr.Motion(y=-3.0)}),), {"t": pr.Plane(touching="b.top")},
        (pr.Contact(("b.top", "b.right"), "t"),), fixed={"b.bottom": "y", "b.left": "x"},
        space="axisymmetric", remesh=pr.Remesh(size),
    )

def until_remeshed():
    next(i for i in pr.solve(meshed_anew()) if i.remeshings)

if IN_A_THREAD:
    worker = threading.Thread(target=until_remeshed)
    worker.start()
    worker.join()
else:
    until_remeshed()
try:
    os.kill(os.getpid(), signal.SIGINT)
    signal.pause()
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
@pytest.mark.parametrize("in_a_thread", [False, True])
def test_ctrl_c_is_heard_after_the_mesher(in_a_thread: bool, tmp_path: Path) -> None:
    """Python's handler is there, of runs in the main thread and in others."""
    script = tmp_path / "run.py"
    script.write_text(RUN.replace("IN_A_THREAD", str(in_a_thread)))
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip().endswith("interrupted")
