"""4-node quadrilateral with enhanced strains, for bending; its kernels are `prensa.elements.enhanced`."""

from __future__ import annotations

from typing import ClassVar, Literal, NamedTuple

import numpy as np

from prensa.elements.element import Chunk, Failure, Mode, Why, Work, material, workspace
from prensa.elements.form import Form
from prensa.elements.kinds.isoparametric import Q4, Isoparametric
from prensa.elements.shapes import Table
from prensa.materials.protocol import At, Material
from prensa.types import Array, Flags

MODE_ITERATIONS = 40  # of the enhanced modes
TOLERANCE = 1e-12  # residual of the enhanced modes over the forces that cancel in it


class Left(NamedTuple):
    """Elements whose modes are not found yet: initial positions X, displacements u (k, a, d), committed F − I Hn (k, q, c),
    history of the law old (k, q, h); modes alpha (k, m), their last step, the share of it that was taken, least residual (k,).
    """

    X: Array
    u: Array
    Hn: Array
    old: Array
    alpha: Array
    step: Array
    share: Array
    least: Array

    @classmethod
    def begin(cls, X: Array, u: Array, Hn: Array, old: Array, alpha: Array) -> Left:
        """Before the first step."""
        return cls(X, u, Hn, old, alpha.copy(), np.zeros_like(alpha), np.ones(len(u)), np.full(len(u), np.inf))

    def of(self, rows: Flags) -> Left:
        """Some of them."""
        return Left._make(a[rows] for a in self)

    def move(self, r: Array, K: Array, over: Array, bad: Flags, reason: Why) -> Failure | None:
        """Modes, in place, after Newton's step for residuals r (k, m) and stiffnesses K (k, m, m).

        Half way back where the last step left the domain (``bad``, for some ``reason``) or the residual grew, which is ``over``
        (k,) times what counts as none: yielding is a kink of it.
        """
        norm = np.linalg.norm(r, axis=1)
        # Near round-off a larger residual says nothing, and across a kink any step may raise it: no more than six halvings for
        # that.
        back = bad | ((norm >= self.least) & (over > 1e3) & (self.share > 0.02))
        go: Flags | slice = slice(None)
        if back.any():
            # No residual known yet: the committed modes themselves are out of the domain at these displacements, and there is
            # no way back.
            stuck = bad & ((self.share < 1e-4) | np.isinf(self.least))
            if stuck.any():
                return Failure(int(np.argmax(stuck)), reason)
            self.share[back] *= 0.5
            self.alpha[back] -= self.share[back, None] * self.step[back]
            go = ~back
        self.least[go], self.share[go] = norm[go], 1.0
        try:
            self.step[go] = -np.linalg.solve(K[go], r[go][..., None])[..., 0]
        except np.linalg.LinAlgError:
            return Failure(int(np.argmax(~back)), Why.SOFT)
        self.alpha[go] += self.step[go]
        return None


class Enhanced(Isoparametric, abstract=True):
    """A 4-node quadrilateral or 8-node brick with enhanced strains; the internal modes are solved for at every evaluation.

    Its own history: F − I of each point (5 columns, in space 9) and the modes, shared out over the points.
    """

    follows_gradients: ClassVar[bool] = True
    even_along_itself: ClassVar[bool] = True
    across: ClassVar[int] = 0
    """Further modes of the strain across: Legendre polynomials in η from the second degree on."""

    def extra(self, mode: Mode) -> int:
        """F − I and the columns that the modes need."""
        return self.layout.components + -(-self.modes(mode) // self.points)

    def modes(self, mode: Mode) -> int:
        """How many there are."""
        from prensa.elements import enhanced

        return enhanced.SPACE_MODES if self.layout.dimension == 3 else enhanced.MODES[mode.axisymmetric] + self.across

    def _form(self, mode: Mode) -> Form:
        """Of the kernels."""
        nodes, points = self.nodes, self.points
        return Form(nodes, points, self.layout.dimension, mode.axisymmetric, mode.finite, modes=self.modes(mode))

    def _numbers(self, mode: Mode) -> Array:
        """Of the points, for the kernels."""
        from prensa.elements import enhanced

        return enhanced.numbers(self.table, self.modes(mode), mode.axisymmetric)

    def symmetric(self, mode: Mode) -> bool:
        """Always: the modes are eliminated from a symmetric system."""
        return True

    def respond(self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, stiffness: bool) -> Failure | None:
        """See `Element`."""
        from prensa.elements import enhanced

        finite = mode.finite
        whole, at = at, at._replace(secant=0.0)  # the modes are iterated with the tangent
        u = c.x - c.X + c.d if finite else c.d
        strain = slice(law.size, law.size + self.layout.components)
        Hn = np.ascontiguousarray(c.old[..., strain])
        alpha, H = self._modes(c.old, strain.stop, mode), np.empty_like(Hn)
        if not finite:
            # increments of displacement, strain and modes; the modes that are kept are their sum
            Hn = np.zeros_like(Hn)
            kept, alpha = alpha, np.zeros_like(alpha)
        k, m = alpha.shape
        nodal, inner, form = u[0].size, np.empty((k, m, m)), self._form(mode)
        n = nodal + m
        if failure := self._solve(c, law, at, mode, work, u, Hn, alpha, H, inner):
            return failure
        tangent = stiffness and not (whole.secant and law.plastic)
        r, K = np.empty((k, n)), np.empty((k if tangent else 0, n, n))
        there = enhanced.At(c.X, u, alpha, Hn, self._numbers(mode), mode.scale)
        enhanced.integrate(form, there, work.P, work.A, tangent, r, K, work.size)
        # Modes in equilibrium without stiffness are at a limit point of their own, an hourglass; the element is condensed no
        # further.
        weak = np.linalg.eigvalsh(0.5 * (inner + inner.transpose(0, 2, 1)))[:, 0] <= 0.0
        if weak.any():
            return Failure(int(np.argmax(weak)), Why.SOFT)
        if stiffness:
            if not tangent:
                K = self._towards_secant(c, law, whole, mode, u, Hn, alpha)
            # Static condensation. The modes' own forces are zero by now, so that those on the nodes need no correction.
            work.K[:] = _condensed(K, nodal)
        work.r[:] = r[:, :nodal]
        c.new[..., strain] = H if finite else c.old[..., strain] + H
        self._keep(c.new, strain.stop, alpha if finite else kept + alpha)
        return None

    def _solve(
        self, c: Chunk, law: Material, at: At, mode: Mode, work: Work, u: Array, Hn: Array, alpha: Array, H: Array, inner: Array
    ) -> Failure | None:  # fmt: skip
        """Modes alpha (k, m), in place, that are in equilibrium at displacements u: Newton, halved where it goes too far.

        inner (k, m, m): their stiffness there.
        """
        from prensa.elements import enhanced

        form, shapes_, scale = self._form(mode), self._numbers(mode), mode.scale
        at = at._replace(tangent=True)  # Newton needs it in any case
        m, size = alpha.shape[1], law.size
        rows, points = np.arange(len(u)), np.arange(self.points)
        left = Left.begin(c.X, u, Hn, np.ascontiguousarray(c.old[..., :size]), alpha)
        for _ in range(MODE_ITERATIONS):
            k, w = len(rows), workspace(self, len(rows))
            part = Chunk(left.X, left.X, left.u, left.old, np.empty_like(left.old))
            F, bad, reason = np.empty((k, self.points, self.layout.components)), np.zeros(k, dtype=np.bool_), Why.INVERTED
            place = enhanced.At(left.X, left.u, left.alpha, left.Hn, shapes_, scale)
            enhanced.kinematics(form, place, F, w.h, w.w, bad)
            if bad.any():
                # The law is asked at rest where kinematics failed: what it answers there is not used, and no NaN gets into the
                # batch.
                w.h[bad] = 0.0
            there = at if at.flows is None else at.of((self.points * rows[:, None] + points).ravel())
            if failure := material(part, law, there, w):
                bad, reason = bad | w.points.any(axis=1), reason if bad.any() else failure.why
            r, K, noise = np.empty((k, m)), np.empty((k, m, m)), np.empty((k, m))
            enhanced.modes_left(form, place, w.P, w.A, r, K, noise)
            over = (np.abs(r) / np.maximum(TOLERANCE * noise, 1e-300)).max(axis=1)
            done = (over <= 1.0) & ~bad
            if done.any():
                some = rows[done]
                work.P[some], work.A[some], work.w[some], H[some] = w.P[done], w.A[done], w.w[done], F[done]
                alpha[some], c.new[some, :, :size], inner[some] = left.alpha[done], part.new[done], K[done]
                if len(some) == k:
                    return None
                go = ~done
                rows, left, r, K, over, bad = rows[go], left.of(go), r[go], K[go], over[go], bad[go]
            if failure := left.move(r, K, over, bad, reason):
                return Failure(int(rows[failure.element]), failure.why)
        return Failure(int(rows[0]), Why.SOFT)

    def _towards_secant(
        self, c: Chunk, law: Material, at: At, mode: Mode, u: Array, Hn: Array, alpha: Array
    ) -> Array:  # fmt: skip
        """Stiffness (k, n, n) at modes alpha (k, m) that have been found, by them too, with moduli that go towards the secant.

        They come of another update: what the modes were found with are the tangent's.
        """
        from prensa.elements import enhanced

        form, w, k, n = self._form(mode), workspace(self, len(u)), len(u), u[0].size + alpha.shape[1]
        old = np.ascontiguousarray(c.old[..., : law.size])
        part, F = Chunk(c.X, c.X, u, old, np.empty_like(old)), np.empty((k, self.points, self.layout.components))
        there = enhanced.At(c.X, u, alpha, Hn, self._numbers(mode), mode.scale)
        enhanced.kinematics(form, there, F, w.h, w.w, np.zeros(k, dtype=np.bool_))
        material(part, law, at, w)
        r, K = np.empty((k, n)), np.empty((k, n, n))
        enhanced.integrate(form, there, w.P, w.A, True, r, K, w.size)
        return K

    def _modes(self, history: Array, first: int, mode: Mode) -> Array:
        """Modes (k, m) of a history, in its columns from ``first`` on."""
        m = self.modes(mode)
        return history[..., first:].reshape(len(history), -1)[:, :m].copy()

    @staticmethod
    def _keep(history: Array, first: int, alpha: Array) -> None:
        room = history[..., first:]
        flat = np.zeros((len(history), room.shape[1] * room.shape[2]))
        flat[:, : alpha.shape[1]] = alpha
        room[:] = flat.reshape(room.shape)


def _condensed(K: Array, nodal: int) -> Array:
    """Stiffness (k, a, a) on the first ``nodal`` of the unknowns of K (k, n, n)."""
    return np.asarray(
        K[:, :nodal, :nodal] - K[:, :nodal, nodal:] @ np.linalg.solve(K[:, nodal:, nodal:], K[:, nodal:, :nodal])
    )


class Q4Enhanced(Enhanced):
    """4-node quadrilateral with enhanced strains, 2 × 2 points."""

    type: Literal["q4_enhanced"] = "q4_enhanced"
    table: ClassVar[Table] = Q4.table
