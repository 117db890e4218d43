"""The ring test that tests of derivatives and of calibration share: half of a ring 18 : 9 : 6 on a coarse mesh."""

from __future__ import annotations

from prensa.model.problem import Problem
from prensa.model.schema import loads

RING = """
name: ring
space: axisymmetric
bodies:
  ring:
    mesh: {type: rectangle, size: [4.5, 3], n: [4, 3], origin: [4.5, 0]}
    material: {type: j2, E: 200 GPa, nu: 0.3, flow: {type: ludwik, s0: 250, K: 500, n: 0.3}}
tools: {die: {type: plane, touching: ring.top}}
contacts: [{surface: ring, against: die}]
friction: {type: coulomb, mu: 0.1}
fixed: {ring.bottom: y}
steps: [{name: press, move: {die: {y: -0.6}}, increments: 6}]
"""
FLOW = "bodies.ring.material.flow"
MU, K, N = "friction.mu", f"{FLOW}.K", f"{FLOW}.n"


def ring(*changes: str) -> Problem:
    """The ring test with changes, as ``--set`` writes them."""
    return loads(RING, overrides=changes).problem
