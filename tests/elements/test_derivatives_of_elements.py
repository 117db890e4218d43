"""Generated derivatives of elements of metal: against the complex step of the same functions, and against each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.elements import derivatives, gradients, shapes
from prensa.elements.derivatives import BATCH, Along, At, Variant
from prensa.elements.element import Chunk, Mode, element_of, workspace
from prensa.materials import hencky_j2
from prensa.materials.hardening import Knots
from prensa.materials.j2 import metal
from prensa.materials.protocol import At as Context

N, SCALE, STEP = 40, 1.3, 1e-30
TABLED = pr.FlowTable(((0.0, 100.0), (0.05, 150.0), (0.1, 170.0), (0.2, 190.0), (1.0, 220.0)))
SQUARE = np.array([[3.0, 0], [4, 0], [4, 1], [3, 1]])
TRIANGLE = SQUARE[:3]
NODES = {
    "q4_fbar": SQUARE, "q4_bbar": SQUARE, "q8": np.concatenate([SQUARE, 0.5 * (SQUARE + np.roll(SQUARE, -1, axis=0))]),
    "t6": np.concatenate([TRIANGLE, 0.5 * (TRIANGLE + np.roll(TRIANGLE, -1, axis=0))]),
}  # fmt: skip
BARS = ("q4_fbar", "q4_bbar")
CURVES = [None, pr.Ludwik(250.0, 500.0, 0.3), pr.JohnsonCook(250.0, 400.0, 0.3, 0.02, 0.1), TABLED]


def pressed(kind: str, flow: Any, space: str, share: float, cauchy: bool) -> tuple[At, np.ndarray, np.ndarray]:
    """Elements after an increment, some points plastic, with the forces and histories of the element's own kernels."""
    rng = np.random.default_rng(4)
    limit = "cauchy" if cauchy else "kirchhoff"
    material = pr.Elastic(200e3, 0.3) if flow is None else pr.J2(200e3, 0.3, flow, limit)
    law: Any = material.law("finite", space)
    element, mode = element_of(kind), Mode(space == "axisymmetric", True, SCALE)
    work = workspace(element, N)
    x = X = NODES[kind] + 0.05 * rng.standard_normal((N, *NODES[kind].shape))
    committed = old = new = np.zeros((N, element.points, law.size))
    for k in range(3):
        d = 4e-3 * rng.standard_normal(x.shape) + 0.01 * ((x - [3.5, 0.5]) @ np.array([[1, 0.3], [0.2, -1]]))
        d[::5] *= -0.002 if k == 2 else 1.0  # unloaded
        committed, begun, new = new, bool(share and k), np.zeros_like(new)
        old = law.begin(committed.reshape(-1, law.size), share).reshape(committed.shape) if begun else committed
        assert element.respond(Chunk(X, x, d, old, new), law, Context(0.1, 0.1, begun=begun), mode, work, False) is None
        x_n, x = x, x + d
    point_law = law.point_law(0.1)
    bars = kind in BARS, mode.axisymmetric, point_law.form, share > 0.0, kind == "q4_bbar"
    variant = Variant(element.nodes, element.points, *bars)
    return At(variant, element.table.rows, X, x_n, x, committed, old, new, point_law, share, SCALE), work.r.copy(), new


def whole(at: At, places: Any) -> tuple[list[Any], Any, Any]:
    """Volumes of the points in some places, of the element, and the slopes (…, 2a) of its logarithm by the nodes."""
    points = gradients.at_points(places, at.shapes, at.variant.axisymmetric)
    volumes = [g.volume * w for g, w in points]
    slopes = [0.0] * at.variant.dofs
    for v, (g, _) in zip(volumes, points):
        slopes = [
            s + v * (by[i] + (by[2] if i == 0 else 0.0))
            for s, (by, i) in zip(slopes, ((b, i) for b in g.by for i in (0, 1)))
        ]
    return volumes, sum(volumes), np.stack(slopes, axis=-1) / sum(volumes)[:, None]


def plain(at: At, X0: Any, x_n: Any, x: Any, committed: Any, p: Any) -> tuple[Any, Any, Any]:
    """Forces (e, 2a), histories and stored energies (e, q, …) by the point functions of arrays."""
    v = at.variant
    undeformed, X, Y = ([a.reshape(N, -1)[:, k] for k in range(v.dofs)] for a in (X0, x_n, x))
    u = [b - a for a, b in zip(X, Y)]
    form: Any = v.law
    m = metal(form.kind, form.cauchy, p)
    if m.curve is not None:
        m = m._replace(curve=m.curve._replace(table=Knots(at.law.knots, at.law.coefficients)))
    forces, history, energy = 0.0, [], []
    for q in range(v.points):
        g = gradients.gradients(X, list(at.shapes[q, :-1]), v.axisymmetric)
        stretched, ratio = gradients.gradient(u, g), 1.0
        if v.mean:
            (initial, V, _), (_, before, _), (_, now, growth) = (whole(at, places) for places in (undeformed, X, Y))
            stretched, _, _ = gradients.fbar(stretched, now / before - 1.0, v.axisymmetric)
        elif v.bar:
            there = gradients.gradients(X, list(shapes.centre(4, 2)), v.axisymmetric)
            middle = gradients.dilatation(gradients.gradient(u, there))
            stretched, _, ratio = gradients.fbar(stretched, middle, v.axisymmetric)
        b = [committed[:, q, k] for k in range(v.fields)]
        begun, flows = hencky_j2.Begun(b, 0.0, 0.0, b), None
        if m.curve is not None:
            first = hencky_j2.begin(b, at.share, m) if v.shifted else (*b[:6], *b[:4])
            begun = hencky_j2.Begun(first[:4], first[4], first[5], first[6:])
            rise = at.new[:, q, 4] - at.old[:, q, 4]
            flows = hencky_j2.Flows(rise != 0.0, rise)
        found = hencky_j2.hencky_j2(stretched, begun, m, flows)
        volume = g.volume * at.shapes[q, -1] * SCALE / (ratio * np.sqrt(hencky_j2.determinant(begun.b)))
        stress: Any = found.stress
        if v.mean:
            volume = initial[q] * SCALE * before / (V * np.sqrt(hencky_j2.determinant(begun.b)))
            stress, pressure = gradients.without_mean(stress, v.axisymmetric)
            forces = forces + (volume * pressure)[:, None] * growth
        P = hencky_j2.first_piola(gradients.gradient(u, g), stress, volume)
        forces = forces + np.stack(gradients.forces(P, g), axis=-1)
        history.append(np.stack(np.broadcast_arrays(*found.history), axis=-1))
        energy.append(hencky_j2.stored_energy(found, m))
    return forces, np.stack(history, axis=1), np.stack(energy, axis=1)


def directions(at: At) -> Along:
    rng = np.random.default_rng(5)
    h, f = at.variant.fields, at.law
    p = f.p[:, None] * rng.standard_normal((len(f.p), BATCH))
    p[2:4] = 0.0
    table = rng.standard_normal((len(f.knots), BATCH)), rng.standard_normal((*f.coefficients.shape, BATCH))
    if at.variant.law.table_at is not None:  # plain functions find no roots of complex tables: see test_closed
        p[4:] = 0.0
        table = table[0] * 0.0, table[1] * 0.0
    X, x_n, x = rng.standard_normal((3, N, at.variant.nodes, 2, BATCH))
    return Along(X, x_n, x, 1e-2 * rng.standard_normal((N, at.variant.points, h, BATCH)), p, *table)


SPACES = [("axisymmetric", True), ("plane strain", True), ("plane strain", False)]
"""Spaces, and whether the yield stress is that of Cauchy."""


def combinations() -> Iterator[Any]:
    """Elements, spaces, flow curves and shares, each pair of them: the gradients, the curve and the shift of the beginning are
    functions of their own, which all combinations share. A kernel of each combination takes a second to be compiled.
    """
    for k, kind in enumerate(NODES):
        curves = CURVES if kind == "q4_fbar" else CURVES[:2]
        for i, (space, cauchy) in enumerate(SPACES if kind in BARS else SPACES[:2]):
            for j, curve in enumerate(curves):
                if curve is None and (not cauchy or (kind not in BARS and i == k % 2)):
                    continue
                share = 0.4 * ((i + j + k) % 2) if curve is not None else 0.0
                name = "elastic" if curve is None else curve.type
                yield pytest.param(kind, space, cauchy, curve, share, id=f"{kind}-{space}-{cauchy}-{name}-{share}")


@pytest.mark.parametrize(("kind", "space", "cauchy", "curve", "share"), list(combinations()))
def test_derivatives_are_those_of_the_functions(kind: str, space: str, cauchy: bool, curve: Any, share: float) -> None:
    """Values are those of the element's own kernels; directions those of the complex step; weights go back by the transposes."""
    at, r, new = pressed(kind, curve, space, share, cauchy)
    d, v = directions(at), at.variant
    value = plain(at, at.X, at.x_n, at.x, at.committed, at.law.p)
    assert np.abs(value[0] - r).max() <= 1e-12 * np.abs(r).max()
    assert np.abs(value[1] - new).max() <= 1e-12 * np.abs(new).max()
    if curve is not None:
        assert (at.new[..., 4] != at.old[..., 4]).mean() > 0.3
    volume, dnew = np.random.default_rng(6).random((N, v.points)), np.empty((N, v.points, v.fields, BATCH))
    forces = derivatives.forces_along(at, d)
    energy = derivatives.history_along(at, d, volume, dnew)
    for j in range(BATCH):
        start = (a + 1j * STEP * b[..., j] for a, b in zip((at.X, at.x_n, at.x, at.committed, at.law.p), d))
        exact = [a.imag / STEP for a in plain(at, *start)]
        assert np.abs(forces[..., j].reshape(N, -1) - exact[0]).max() <= 1e-12 * np.abs(exact[0]).max()
        for k in range(v.fields):
            assert np.abs(dnew[:, :, k, j] - exact[1][..., k]).max() <= 1e-12 * np.abs(exact[1][..., k]).max(), k
        assert energy[0, j] == pytest.approx((volume * exact[2]).sum(), rel=1e-10)
        if curve is not None:
            assert energy[1, j] == pytest.approx((volume * exact[1][..., 5]).sum(), rel=1e-10)
    rng = np.random.default_rng(7)
    w, weights = rng.standard_normal((N, v.points, v.fields)) * 1e5, rng.standard_normal((N, v.dofs))
    found = derivatives.back(at, w, weights)
    pairs = ((found.X, d.X), (found.x_n, d.x_n), (found.x, d.x), (found.committed, d.committed), (found.p, d.p))
    for j in range(BATCH):
        left = np.vdot(weights, forces[..., j]) + np.vdot(w, dnew[..., j])
        assert left == pytest.approx(sum(np.vdot(a, b[..., j]) for a, b in pairs), rel=1e-10)
    alone = derivatives.back(at, w, 0.0 * weights).x
    assert np.abs(derivatives.history_back(at, w) - alone).max() <= 1e-13 * np.abs(alone).max()
