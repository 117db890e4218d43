"""Elements as a sweep sees them: nodes, points, shape values, and the response of a chunk of elements to its increments.

A response is kinematics → material → integration; an element with internal unknowns repeats the first two until they are
solved. Adding an element: its kernels, a class here, a line in `element_of`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from prensa.elements import enhanced, h8, q4, shapes, solid
from prensa.fem.failure import Why
from prensa.layout import PLANE, SPATIAL, TensorLayout
from prensa.materials.laws import At, Material, Out

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Mode(NamedTuple):
    """Axisymmetric or not, finite or small strain; ``scale`` of volumes: thickness, 2π in axisymmetry, 1 in space."""

    axisymmetric: bool
    finite: bool
    scale: float


class Chunk(NamedTuple):
    """k elements with a nodes: initial positions X, committed ones x (small strain: X) and increments d (k, a, dim).

    old, new (k, q, h): committed and trial history, the law's columns first, then the element's.
    """

    X: Array
    x: Array
    d: Array
    old: Array
    new: Array


class Work(NamedTuple):
    """Scratch and results of a chunk: r (k, dim a) forces, K (k, dim a, dim a), size (k,) Σ |r| before points cancel."""

    h: Array
    w: Array
    alpha: Array
    P: Array
    A: Array
    r: Array
    K: Array
    size: Array
    flags: Flags
    points: Flags

    def first(self, k: int) -> Work:
        """The rows of the first k elements."""
        return Work._make(a[:k] for a in self)


class Failure(NamedTuple):
    """An element of the chunk that could not be evaluated, and why."""

    element: int
    why: Why


MODE_ITERATIONS = 40  # of the enhanced modes
TOLERANCE = 1e-12  # residual of the enhanced modes over the forces that cancel in it


class Element(Protocol):
    """A formulation. ``N`` (q, a): shape values at the points; ``extra``: columns it adds to the law's history."""

    @property
    def layout(self) -> TensorLayout:
        """Unknowns of a node and components of the tensors that go to the law, whose layout must be the same."""

    @property
    def nodes(self) -> int:
        """Nodes a."""

    @property
    def points(self) -> int:
        """Integration points q."""

    @property
    def N(self) -> Array:
        """Shape functions at the points (q, a)."""

    def extra(self, mode: Mode) -> int:
        """History columns of the element itself."""

    def symmetric(self, mode: Mode) -> bool:
        """Whether its stiffness is symmetric when that of the law is."""

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, q) of the points and flags (k,) of folded elements."""

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """Forces, with ``stiffness`` their exact derivative, and the new history of a chunk. Pure."""


def workspace(element: Element, k: int) -> Work:
    """Arrays for chunks of up to k elements."""
    q, c, m = element.points, element.layout.components, element.layout.dimension * element.nodes
    return Work(
        np.empty((k, q, c)), np.empty((k, q)), np.empty((k, q)), np.empty((k, q, c)), np.empty((k, q, c, c)),
        np.empty((k, m)), np.empty((k, m, m)), np.empty(k), np.empty(k, dtype=np.bool_), np.empty((k, q), dtype=np.bool_),
    )  # fmt: skip


def material(c: Chunk, law: Material, at: At, work: Work) -> Failure | None:
    """The law at all points of a chunk, from work.h to work.P, work.A and c.new."""
    n, m = work.points.size, work.h.shape[-1]
    work.points[:] = False
    out = Out(work.P.reshape(n, m), work.A.reshape(n, m, m), c.new.reshape(n, -1), work.points.reshape(n))
    law.update(work.h.reshape(n, m), c.old.reshape(n, -1), at, out)
    return Failure(int(np.argmax(work.points.any(axis=1))), Why.LAW) if work.points.any() else None


@dataclass(frozen=True)
class _Q4:
    """What every 4-node quadrilateral with 2 × 2 points has in common."""

    nodes: int = 4
    points: int = 4
    layout: TensorLayout = PLANE

    @property
    def N(self) -> Array:
        """Shape functions at the points (4, 4)."""
        return _TABLES["q4"].N

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, 4) and flags (k,) of folded elements."""
        return Solid("q4").volumes(X, mode)


@dataclass(frozen=True)
class Q4Bar(_Q4):
    """4-node quadrilateral with F-bar (small strain: B-bar), by its own fast kernels."""

    def extra(self, mode: Mode) -> int:
        """No history of its own."""
        return 0

    def symmetric(self, mode: Mode) -> bool:
        """B-bar derives from an energy, F-bar does not."""
        return not mode.finite

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        axi, finite, scale = mode
        work.flags[:] = False
        q4.kinematics(c.x, c.d, axi, finite, scale, work.h, work.w, work.alpha, work.flags)
        if work.flags.any():
            return Failure(int(np.argmax(work.flags)), Why.INVERTED)
        if failure := material(c, law, at, work):
            return failure
        q4.integrate(c.x, c.d, axi, finite, work.w, work.alpha, work.P, work.A, work.size, stiffness, work.r, work.K)
        return None


_TABLES = {
    "t3": shapes.table(3, shapes.triangle(1)),
    "t6": shapes.table(6, shapes.triangle(3)),
    "q4": shapes.table(4, shapes.square(2)),
    "q8": shapes.table(8, shapes.square(2)),
    "q8_full": shapes.table(8, shapes.square(3)),
}


@dataclass(frozen=True)
class Solid:
    """Isoparametric element of a shape table: ``t3``, ``t6``, ``q4``, ``q8`` (2 × 2 points), ``q8_full`` (3 × 3)."""

    name: str
    layout: TensorLayout = PLANE

    @property
    def nodes(self) -> int:
        """Nodes a."""
        return self.N.shape[1]

    @property
    def points(self) -> int:
        """Integration points q."""
        return self.N.shape[0]

    @property
    def N(self) -> Array:
        """Shape functions at the points (q, a)."""
        return _TABLES[self.name].N

    def extra(self, mode: Mode) -> int:
        """No history of its own."""
        return 0

    def symmetric(self, mode: Mode) -> bool:
        """Always: forces and stiffness are derivatives of the strains."""
        return True

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, q) and flags (k,) of folded elements."""
        h, w = np.empty((len(X), self.points, self.layout.components)), np.empty((len(X), self.points))
        failed = np.zeros(len(X), dtype=np.bool_)
        t = _TABLES[self.name]
        solid.kinematics(X, np.zeros_like(X), t.N, t.dN, t.weight, mode.axisymmetric, False, mode.scale, h, w, failed)
        return w, failed

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        t = _TABLES[self.name]
        work.flags[:] = False
        solid.kinematics(
            c.x, c.d, t.N, t.dN, t.weight, mode.axisymmetric, mode.finite, mode.scale, work.h, work.w, work.flags
        )
        if work.flags.any():
            return Failure(int(np.argmax(work.flags)), Why.INVERTED)
        if failure := material(c, law, at, work):
            return failure
        solid.integrate(c.x, t.N, t.dN, mode.axisymmetric, work.w, work.P, work.A, work.size, stiffness, work.r, work.K)
        return None


@dataclass(frozen=True)
class Q4Enhanced(_Q4):
    """4-node quadrilateral with enhanced strains, for bending; the internal modes are solved for at every evaluation.

    Its own history: F − I of each point (5 columns) and the modes, shared out over the points.
    """

    def extra(self, mode: Mode) -> int:
        """F − I and the columns that the modes need."""
        return self.layout.components + -(-enhanced.MODES[mode.axisymmetric] // self.points)

    def symmetric(self, mode: Mode) -> bool:
        """Always: the modes are eliminated from a symmetric system."""
        return True

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        axi, finite, _ = mode
        u = c.x - c.X + c.d if finite else c.d
        first = law.size
        Hn = np.ascontiguousarray(c.old[..., first : first + 5])
        alpha, H = self._modes(c.old, first, mode), np.empty_like(Hn)
        if not finite:
            # increments of displacement, strain and modes; the modes that are kept are their sum
            Hn = np.zeros_like(Hn)
            kept, alpha = alpha, np.zeros_like(alpha)
        if failure := self._solve(c, law, at, mode, work, u, Hn, alpha, H):
            return failure
        k, n = len(u), 8 + alpha.shape[1]
        r, K, noise = np.empty((k, n)), np.empty((k, n, n)), np.empty((k, n))
        enhanced.integrate(c.X, u, alpha, H, axi, finite, work.w, work.P, work.A, 0, r, K, work.size, noise)
        inner = K[:, 8:, 8:]
        weak = np.linalg.eigvalsh(0.5 * (inner + inner.transpose(0, 2, 1)))[:, 0] <= 0.0
        if weak.any():
            return Failure(int(np.argmax(weak)), Why.SOFT)
        if stiffness:
            work.K[:] = K[:, :8, :8] - K[:, :8, 8:] @ np.linalg.solve(inner, K[:, 8:, :8])
        work.r[:] = r[:, :8]
        c.new[..., first : first + 5] = H if finite else c.old[..., first : first + 5] + H
        self._keep(c.new, first, alpha if finite else kept + alpha)
        return None

    def _solve(
        self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, u: Array, Hn: Array, alpha: Array, H: Array
    ) -> Failure | None:  # fmt: skip
        """Modes alpha (k, m), in place, that are in equilibrium at displacements u: Newton, halved where it goes too far."""
        axi, finite, scale = mode
        at = at._replace(tangent=True)  # Newton needs it in any case
        n, size = 8 + alpha.shape[1], law.size
        rows = np.arange(len(u))
        step, share, least = np.zeros_like(alpha), np.ones(len(u)), np.full(len(u), np.inf)
        for _ in range(MODE_ITERATIONS):
            k = len(rows)
            w = workspace(self, k)
            old = np.ascontiguousarray(c.old[rows, :, :size])
            part = Chunk(c.X[rows], c.x[rows], c.d[rows], old, np.empty_like(old))
            F, bad, reason = np.empty((k, 4, self.layout.components)), np.zeros(k, dtype=np.bool_), Why.INVERTED
            enhanced.kinematics(part.X, u[rows], alpha[rows], Hn[rows], axi, finite, scale, F, w.h, w.w, bad)
            w.h[bad] = 0.0
            if failure := material(part, law, at, w):
                bad, reason = bad | w.points.any(axis=1), reason if bad.any() else failure.why
            if finite:
                enhanced.pull_back(Hn[rows], w.P, w.A)
            r, K, noise = np.empty((k, n)), np.empty((k, n, n)), np.empty((k, n))
            # a body let go has no strain left, but the round-off of that which it had when the increment began
            strain = np.abs(F) + np.abs(Hn[rows])
            enhanced.integrate(part.X, u[rows], alpha[rows], strain, axi, finite, w.w, w.P, w.A, 8, r, K, w.size, noise)
            over = (np.abs(r[:, 8:]) / np.maximum(TOLERANCE * noise[:, 8:], 1e-300)).max(axis=1)
            done = (over <= 1.0) & ~bad
            some = rows[done]
            work.P[some], work.A[some], work.w[some], H[some] = w.P[done], w.A[done], w.w[done], F[done]
            c.new[some, :, :size] = part.new[done]
            if done.all():
                return None
            norm = np.linalg.norm(r[:, 8:], axis=1)
            # half way back where the step left the domain or the residual grew (yielding is a kink of it)
            back = bad | ((norm >= least[rows]) & (over > 1e3) & (share[rows] > 0.02))
            stuck = bad & (share[rows] < 1e-4) | bad & np.isinf(least[rows])
            if stuck.any():
                return Failure(int(rows[np.argmax(stuck)]), reason)
            some = rows[back]
            share[some] *= 0.5
            alpha[some] -= share[some, None] * step[some]
            go = ~(back | done)
            some, inner = rows[go], K[go, 8:, 8:]
            least[some], share[some] = norm[go], 1.0
            try:
                step[some] = -np.linalg.solve(inner, r[go, 8:, None])[..., 0]
            except np.linalg.LinAlgError:
                return Failure(int(some[0]), Why.SOFT)
            alpha[some] += step[some]
            rows = rows[~done]
        return Failure(int(rows[0]), Why.SOFT)

    @staticmethod
    def _modes(history: Array, first: int, mode: Mode) -> Array:
        """Modes (k, m) of a history."""
        m = enhanced.MODES[mode.axisymmetric]
        return history[..., first + 5 :].reshape(len(history), -1)[:, :m].copy()

    @staticmethod
    def _keep(history: Array, first: int, alpha: Array) -> None:
        room = history[..., first + 5 :]
        flat = np.zeros((len(history), room.shape[1] * room.shape[2]))
        flat[:, : alpha.shape[1]] = alpha
        room[:] = flat.reshape(room.shape)


@dataclass(frozen=True)
class H8:
    """8-node brick with 2 × 2 × 2 points; with ``bar``, F-bar (small strain: B-bar)."""

    bar: bool
    nodes: int = h8.BRICK_NODES
    points: int = h8.BRICK_POINTS
    layout: TensorLayout = SPATIAL

    @property
    def N(self) -> Array:
        """Shape functions at the points (8, 8)."""
        return h8.BRICK.N

    def extra(self, mode: Mode) -> int:
        """No history of its own."""
        return 0

    def symmetric(self, mode: Mode) -> bool:
        """B-bar derives from an energy, F-bar does not."""
        return not (self.bar and mode.finite)

    def volumes(self, X: Array, mode: Mode) -> tuple[Array, Flags]:
        """Initial volumes (k, 8) and flags (k,) of folded elements."""
        work = workspace(self, len(X))
        work.flags[:] = False
        h8.kinematics(X, np.zeros_like(X), False, False, work.h, work.w, work.alpha, work.flags)
        return work.w, work.flags

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        work.flags[:] = False
        h8.kinematics(c.x, c.d, self.bar, mode.finite, work.h, work.w, work.alpha, work.flags)
        if work.flags.any():
            return Failure(int(np.argmax(work.flags)), Why.INVERTED)
        if failure := material(c, law, at, work):
            return failure
        h8.integrate(
            c.x, c.d, self.bar, mode.finite, work.w, work.alpha, work.P, work.A, work.size, stiffness, work.r, work.K
        )
        return None


@cache
def element_of(name: str) -> Element:
    """The element of a description by its name.

    Raises
    ------
    KeyError
        For an unknown name.

    """
    if name == "q4_fbar":
        return Q4Bar()
    if name == "q4_enhanced":
        return Q4Enhanced()
    if name in ("h8", "h8_fbar"):
        return H8(name == "h8_fbar")
    if name not in _TABLES:
        raise KeyError(name)
    return Solid(name)
