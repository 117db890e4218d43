"""Residual and tangent of a converged increment, for whoever wants to look at them or build on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from prensa.result.views import Shown
from prensa.system.interaction import Context, Request
from prensa.system.system import System
from prensa.types import Array, Flags, Index

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True, repr=False)
class ContactBlock(Shown):
    """What a contact adds to residual and tangent, pair by pair (an integration point against the tool); k pairs of m dofs.

    ``dofs`` (k, m) degrees of freedom, ``r`` (k, m), ``K`` (k, m, m): ``r[dofs] += r`` and so on; of stretching edges under a
    traction that does not follow the pressure ``more`` holds further blocks (dofs, K). ``closed``, ``slips`` (k,) flags.
    """

    dofs: Index
    r: Array
    K: Array
    closed: Flags
    slips: Flags
    more: tuple[tuple[Index, Array], ...] = ()

    def _line(self) -> str:
        return f"{len(self.dofs)} pairs of {self.dofs.shape[1]} dofs, {self.closed.sum()} closed, {self.slips.sum()} slip"


@dataclass(frozen=True, repr=False)
class Assembled(Shown):
    """Residual and tangent at the end of an increment, with the increment before as the committed state.

    ``r`` (ndof,) = f_int − f_contact − f_ext and ``K`` (ndof, ndof) = ∂r/∂u, exact and in general unsymmetric. Rows and
    columns of prescribed degrees of freedom are there: r is the reaction. ``u`` (ndof,) where they are taken, ``f_ext`` (ndof,).
    ``free``: degrees of freedom that are unknowns; of tied bodies K is not yet condensed onto the masters: see `solve`.
    ``nodes`` (n, d) by body, ``tools`` (3,) by name (x, y, rotation): where their degrees of freedom stand.
    ``contacts`` by name: their blocks. ``scale``: Σ |element forces| + |contact| + |external|, which residuals are compared with.
    """

    r: Array
    K: csr_matrix
    u: Array
    f_ext: Array
    free: Index
    nodes: Mapping[str, Index]
    tools: Mapping[str, Index]
    contacts: Mapping[str, ContactBlock]
    scale: float
    transform: csr_matrix
    """T (ndof, free): u = T u_free for changes; equations of the unknowns are Tᵀ r and Tᵀ K T."""

    @property
    def residual(self) -> float:
        """Σ |Tᵀ r| over the scale (rotations as the solver weighs them are left out)."""
        return float(np.abs(self.transform.T @ self.r).sum() / self.scale)

    def solve(self, f: Array) -> Array:
        """Change (ndof,) of the degrees of freedom under further forces f (ndof,): K⁻¹ f in the unknowns, 0 elsewhere."""
        from scipy.sparse.linalg import spsolve

        reduced = (self.transform.T @ self.K @ self.transform).tocsc()
        return np.asarray(self.transform @ spsolve(reduced, self.transform.T @ np.asarray(f, dtype=float)))

    def _line(self) -> str:
        return f"{len(self.r)} dofs, {len(self.free)} free, {self.K.nnz} entries, residual {self.residual:.1e}"


def assembled(system: System, c: Context, u: Array, lam: Array) -> Assembled:
    """The equations of an increment with context *c* at degrees of freedom u (ndof,) and multipliers lam (points, 1 + t)."""
    from scipy.sparse import csr_matrix, identity

    e = system.evaluate(c, u, lam)
    assert e.data is not None and not e.failed
    pattern, n = system.pattern, system.ndof
    K = csr_matrix((e.data, pattern.indices, pattern.indptr), shape=(n, n))
    if system.ties is not None:
        free, T = system.ties.kept(n, c.plan.fixed), system.ties.free(n, c.plan.fixed)
    else:
        free = np.setdiff1d(np.arange(n), c.plan.fixed)
        T = csr_matrix(identity(n, format="csr")[:, free])
    nodes = {body: system.dofs.displacement.dofs(system.nodes_of(body)) for body in system.meshes}
    tools = {t.name: np.asarray(system.dofs.tool.dofs(k)) for k, t in enumerate(system.tools)}
    return Assembled(e.r, K, u, e.f_ext, free, nodes, tools, _contacts(system, c, u, lam), e.scale, T)


def _contacts(system: System, c: Context, u: Array, lam: Array) -> dict[str, ContactBlock]:
    reach = system.length + float(np.abs(system.dofs.tool.of(u)[:, : system.dofs.dimension]).max(initial=0.0))
    ask, out = Request(u, system.multipliers(u, lam), reach=reach), {}
    for s, contact in zip(system.surfaces, system._contacts):
        response = contact.respond(c, ask)
        first, *others = response.parts
        assert first.r is not None and first.K is not None
        more = tuple((p.dofs, p.K) for p in others if p.K is not None)
        f = response.trial
        assert f is not None
        out[s.name] = ContactBlock(first.dofs, first.r, first.K, f.p > 0, np.asarray(f.slip), more)
    return out
