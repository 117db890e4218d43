"""A case that takes a few hundredths of a second, and one whose material does what a test wants of its process."""

from __future__ import annotations

from pathlib import Path

CASE = """\
name: pressed block
space: plane strain
bodies:
  block:
    mesh: {type: rectangle, size: [2, 1], n: [4, 2]}
    material: {type: j2, E: 200 GPa, nu: 0.3, flow: {type: ludwik, s0: 250, K: 500, n: 0.3}}
tools: {punch: {type: plane, touching: block.top}}
contacts: [{surface: block.top, against: punch}]
friction: {type: coulomb, mu: 0.1}
fixed: {block.bottom: y, block.left: x}
steps:
  - {name: down, move: {punch: {y: -0.1}}, increments: 3}
  - {name: up, move: {punch: {y: -0.09}}, increments: 2}
"""

LAW = '''\
"""A flow curve that kills the worker that computes with it: once where K is 501, always where it is 502."""

import multiprocessing
import os
import signal
from pathlib import Path

from prensa import FlowCurve


class Deadly(FlowCurve):
    """s0 + K e^n."""

    s0: float
    K: float
    n: float

    def stress(self, strain, rate):
        mark = Path(__file__).with_name(f"killed-{self.K:g}")
        if multiprocessing.parent_process() and (self.K == 502 or (self.K == 501 and not mark.exists())):
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return self.s0 + self.K * (strain + 1e-6) ** self.n
'''


def written(folder: Path, name: str = "press.yaml", text: str = CASE) -> Path:
    """The case as a file of *folder*."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
