"""Stiffness of every element in space with every law, flow curve and kinematics against differences of the forces."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import block_of, bricks, respond, tetrahedra
from prensa.registry import DOORS

E, NU = 1000.0, 0.3
ELEMENTS = ["h8", "h8_fbar", "h8_bbar", "h8_enhanced", "t10"]
FLOW = [
    pr.Perfect(20.0), pr.Linear(20.0, 50.0), pr.Ludwik(20.0, 50.0, 0.3), pr.Swift(40.0, 0.01, 0.2), pr.Voce(20.0, 20.0, 8.0),
    pr.HockettSherby(20.0, 40.0, 2.0, 0.6), pr.SwiftVoce(K=40.0, e0=0.007, n=0.26, s0=15.0, Q=20.0, b=12.0, w=0.6),
    pr.JohnsonCook(20.0, 50.0, 0.3, 0.02, 1e-3), pr.FlowTable(((0.0, 20.0), (0.1, 30.0), (1.0, 40.0))),
    pr.HenselSpittel(A=40.0, T=20.0, e0=0.01, rate0=0.1, m2=0.2, m3=0.05, m4=-1e-3),
]  # fmt: skip
ELASTIC = [pr.NeoHooke(E, NU), pr.StVenantKirchhoff(E, NU)]
AXES = {"r": (0.8, 1.4, 1.9), "M": 1.8, "L": 1.3, "rolling": (0.3, -0.5, 0.8), "normal": (0.8, 0.48, 0.0)}
"""Of rolled sheet, across those of the elements; what flow curves do is in J2's rows."""
LAWS = [
    (pr.Elastic(E, NU), "small"), (pr.Elastic(E, NU), "finite"), *((law, "finite") for law in ELASTIC),
    *((pr.J2(E, NU, flow), "small") for flow in FLOW),
    *((pr.J2(E, NU, flow, limit), "finite") for flow in FLOW for limit in ("cauchy", "kirchhoff")),
    *((pr.Hill(E, NU, flow, **AXES), kinematics) for flow in (FLOW[3], FLOW[7]) for kinematics in ("small", "finite")),
]  # fmt: skip


def name(case) -> str:
    material, kinematics = case
    flow = getattr(material, "flow", None)
    return "-".join([material.type, *([flow.type, getattr(material, "yield_on", "cauchy")] if flow else []), kinematics])


def test_nothing_is_left_out():
    """Elements of space, materials and flow curves are all of those that there are."""
    assert {k for k, e in DOORS["element"].own().items() if e.layout.dimension == 3} == set(ELEMENTS)
    assert {type(m) for m, _ in LAWS} == set(DOORS["material"].own().values())
    assert {type(flow) for flow in FLOW} == set(DOORS["flow"].own().values())


def one(element):
    """A crooked element (nodes, 3), (1, nodes), the only one of its mesh."""
    if element == "t10":
        X, cells, _ = tetrahedra((1, 1, 1), (1.0, 1.0, 1.0))
        X = X[cells[0]]
    else:
        X, _, _ = bricks((1, 1, 1), (1.0, 1.0, 1.0))
        X = X[[0, 4, 6, 2, 1, 5, 7, 3]]
    return X + 0.05 * np.random.default_rng(1).uniform(-1, 1, size=X.shape), np.arange(len(X))[None]


@pytest.mark.parametrize("case", LAWS, ids=name)
@pytest.mark.parametrize("element", ELEMENTS)
def test_stiffness_is_the_derivative_of_the_forces(element, case):
    """All columns within 1e-6 of the largest entry, from a committed state; points of metal flow; K = Kᵀ where it is said so."""
    X, cells = one(element)
    block, pattern = block_of(X, cells, element, *case)
    rng, finite = np.random.default_rng(2), case[1] == "finite"
    bent = np.stack([0.06 * X[:, 0] * X[:, 1], -0.03 * X[:, 0] ** 2, 0.02 * X[:, 2] * X[:, 0]], axis=1)
    before = respond(block, pattern, X, 0.5 * bent, block.undeformed)[2].history
    x = X + 0.5 * bent if finite else X
    du = (0.5 * bent + 0.003 * rng.normal(size=X.shape)).ravel()
    _, K, result = respond(block, pattern, x, du, before, stiffness=True)
    assert result.failed is None
    if block.law.plastic:
        strain = block.law.fields["plastic_strain"].columns
        assert (result.history[..., strain] > before[..., strain]).mean() > 0.4
    if element == "h8_enhanced":  # its modes are at work
        assert np.abs(result.history[..., block.law.size + 9 :]).max() > 1e-3
    fd, h = np.empty_like(K), 1e-5
    for k, step in enumerate(h * np.eye(X.size)):
        a, b, twice, minus = (respond(block, pattern, x, du + s * step, before)[0].ravel() for s in (1, -1, 2, -2))
        fd[:, k] = (8.0 * (a - b) - (twice - minus)) / (12.0 * h)
    assert np.abs(fd - K).max() <= 1e-6 * np.abs(K).max()
    if block.element.symmetric(block.mode) and block.law.symmetric:
        assert np.abs(K - K.T).max() <= 1e-12 * np.abs(K).max()
