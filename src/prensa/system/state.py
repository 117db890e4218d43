"""The committed state variables: everything that the next increment depends on, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, overload

import numpy as np

from prensa.contact.record import ContactRecord
from prensa.system.mesh_state import Remeshed
from prensa.types import Array, Single, Stored


class Recovered(Sequence[Array]):
    """Histories, one (elements, points, h) array per block, that are computed when first asked for.

    Only for bodies whose histories follow from their displacements alone; ``energy``: ∫ψ dV, known without them.
    """

    def __init__(self, compute: Callable[[], Sequence[Array]], energy: float) -> None:
        self.energy = energy
        self._compute = compute
        self._arrays: Sequence[Array] | None = None

    @property
    def arrays(self) -> Sequence[Array]:
        """The arrays."""
        if self._arrays is None:
            self._arrays = self._compute()
        return self._arrays

    @overload
    def __getitem__(self, index: int) -> Array: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Array]: ...
    def __getitem__(self, index: int | slice) -> Array | Sequence[Array]:
        return self.arrays[index]

    def __len__(self) -> int:
        return len(self.arrays)


class Clock(NamedTuple):
    """Where a run stands: number of the step (from 0), increments so far, time, duration of the next increment.

    ``dt`` is 0 where nothing is known of the next increment. ``damping``: how well the second difference of one increment
    predicted that of the next (0 … 1). ``unsteady``: how much plastic flow changed in the last increment, per time (see
    `prensa.system.time_integration.unsteadiness`).
    """

    step: int = 0
    number: int = 0
    time: float = 0.0
    dt: float = 0.0
    damping: float = 0.0
    unsteady: float = 0.0


class Energy(NamedTuple):
    """The energy balance: work of the loads, what is stored, what is dissipated, and what does not add up."""

    external: float = 0.0
    elastic: float = 0.0
    plastic: float = 0.0
    friction: float = 0.0
    contact: float = 0.0
    imbalance: float = 0.0
    viscous: float = 0.0

    @property
    def largest(self) -> float:
        """The largest of the energies, by size: what an imbalance is compared with."""
        return max(abs(self.external), abs(self.elastic), abs(self.plastic), abs(self.friction), abs(self.contact))


class Stability(NamedTuple):
    """What stability goes by: ``negative`` modes of the last equilibrium, and the viscous forces of a stabilised step.

    ``viscosity``: force over velocity and volume; it follows from ``motion``, ∫∫ |v|² dV dt, and ``work`` of the step so far.
    ``since``: increments since modes were looked at, and how many may pass without (``rest``).
    """

    negative: int = 0
    viscosity: float = 0.0
    motion: float = 0.0
    work: float = 0.0
    since: int = 0
    rest: int = 0


UNKNOWN = Stability()


@dataclass(frozen=True)
class State:
    """A committed configuration. Arrays are never written again once they are here.

    ``u`` (ndof,) degrees of freedom as in the system's `DofMap`, from the initial configuration; ``du`` (ndof,) the last
    increment's change, ``dt_last`` its duration and ``second_difference`` (ndof,) the second divided difference of the last
    two increments (for `extrapolated`; of condensed bodies that of their contact candidates alone); ``history``
    one (elements, points, h) array per block, flattened together; ``contact`` the contact points; ``lam`` (points, 1 + t)
    normal and tangential multipliers; ``work`` (ndof,) forces of the last committed increment; ``step_start`` (ndof,) the
    degrees of freedom at the start of the present step; ``release`` (ndof,) forces carried at that time beyond those that the
    step asks for, which it releases linearly; None if there are none; ``self_equilibrated`` the same of tools that are
    gone, as matrices
    of the elements (see `system/self_equilibrated.py`);
    ``stability`` of the last equilibrium; ``ends`` (steps,) times at which the steps so far ended, and ``watched`` (criteria,)
    values of what may end the present one; ``softest`` (modes,): stiffnesses of the softest modes when they were last looked at;
    ``tool_work`` (tools,): work of each tool in the present step; ``tool_wear`` (tools,): normal force times way of slip on each
    tool since the run began (force × length), of which Archard's law makes the worn volume;
    ``remeshed``: the meshes, where they are not those of the description; ``made_from``: values, in single precision, of
    the matrix whose factors are at hand (of its lower triangle where it is symmetric), which the next increment may begin with;
    None if it makes its own;
    ``largest_energies`` (2,): of the balance in the run before the present step, and so far;
    ``damage``: by block D (elements, points, laws), where some body has damage laws; () where none has;
    ``derivatives``: by the path of a parameter, those of the `moving` arrays by it.
    """

    u: Array
    du: Array
    dt_last: float
    second_difference: Array
    history: Sequence[Array]
    contact: ContactRecord
    lam: Array
    energy: Energy
    work: Array
    clock: Clock
    step_start: Array
    release: Array | None = None
    self_equilibrated: Array | None = None
    stability: Stability = UNKNOWN
    derivatives: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    ends: Array = field(default_factory=lambda: np.zeros(0))
    watched: Array = field(default_factory=lambda: np.zeros(0))
    softest: Array = field(default_factory=lambda: np.zeros(0))
    tool_work: Array = field(default_factory=lambda: np.zeros(0))
    tool_wear: Array = field(default_factory=lambda: np.zeros(0))
    remeshed: Remeshed | None = None
    made_from: Single | None = None
    damage: tuple[Array, ...] = ()
    largest_energies: Array = field(default_factory=lambda: np.zeros(2))

    def extrapolated(self, dt: float) -> Array:
        """Change of the degrees of freedom (ndof,) in the next ``dt``, extrapolated from the last increments."""
        last = self.dt_last
        return (dt / last) * self.du + (self.clock.damping * dt * (dt + last)) * self.second_difference

    def damped_difference(self, du: Array, dt: float, nodal: slice) -> tuple[Array, float]:
        """Second divided difference (ndof,) when ``du`` in ``dt`` follows on this state, and its damping (0 … 1).

        Where nodes land, or points change from stick to slip, motions have kinks: the difference before says nothing about
        that after. The new one counts as far as the two are alike (at ``nodal``, the displacements): their product over
        the larger one's square, so that a difference that is nothing but round-off vouches for none.
        """
        if not self.dt_last > 0:
            return np.zeros_like(du), 0.0
        difference = (du / dt - self.du / self.dt_last) / (dt + self.dt_last)
        return difference, _alike(difference[nodal], self.second_difference[nodal])

    def arrays(self) -> dict[str, Stored]:
        """Flat mapping of names to arrays, for checkpoints: 'clock.time', 'contact.slip', 'history_0' …"""
        out: dict[str, Stored] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name in ("history", "damage"):
                out |= {f"{f.name}_{i}": a for i, a in enumerate(value)}
            elif f.name == "contact":
                out |= {f"contact.{part.name}": getattr(value, part.name) for part in fields(value)}
            elif f.name == "derivatives":
                out |= _as_arrays(value)
            elif value is None:
                continue
            elif f.name == "made_from":
                out[f.name] = value
            elif isinstance(value, Remeshed):
                out |= value.arrays()
            elif isinstance(value, tuple):
                named: Any = value
                out |= {f"{f.name}.{k}": np.asarray(v) for k, v in named._asdict().items()}
            else:
                out[f.name] = np.asarray(value, dtype=np.float64)
        return out

    def moving(self) -> dict[str, Array]:
        """Those of `arrays` that change with the parameters of a problem: not the clock, flags, and what a guess is made of."""
        guess = ("clock.", "dt_last", "du", "second_difference")
        looks = ("stability.negative", "stability.since", "stability.rest", "softest", "made_from", "largest_energies")
        fixed = (*guess, *looks, "contact.closed", "contact.time", "ends", "watched", "remeshed", "derivative")
        return {k: np.asarray(a, dtype=np.float64) for k, a in self.arrays().items() if not k.startswith(fixed)}

    def moved(self, directions: Mapping[str, Array], step: float) -> State:
        """The state with a step along directions of its `moving` arrays; without derivatives."""
        arrays = replace(self, derivatives={}).arrays()
        own = {k: np.asarray(arrays[k], dtype=np.float64) for k in directions if k in arrays}
        return State.from_arrays(arrays | {k: a + step * directions[k] for k, a in own.items()})

    @classmethod
    def from_arrays(cls, arrays: dict[str, Stored]) -> State:
        """Inverse of `arrays`, bit for bit."""
        values: dict[str, Any] = {}
        for f in fields(cls):
            if f.name in ("history", "damage"):
                n = sum(k.startswith(f"{f.name}_") for k in arrays)
                values[f.name] = tuple(np.array(arrays[f"{f.name}_{i}"]) for i in range(n))
            elif f.name == "contact":
                columns: dict[str, Any] = {p.name: np.array(arrays[f"contact.{p.name}"]) for p in fields(ContactRecord)}
                values["contact"] = ContactRecord(**columns)
            elif f.name == "derivatives":
                values[f.name] = _from_arrays(arrays)
            elif f.name == "remeshed":
                values[f.name] = Remeshed.from_arrays(arrays)
            elif f.name == "largest_energies" and f.name not in arrays:  # of a run before they were kept
                values[f.name] = np.zeros(2)
            elif f.name == "dt_last":
                values[f.name] = float(arrays[f.name])
            elif f.name in ("release", "self_equilibrated", "made_from") and f.name not in arrays:
                values[f.name] = None
            elif f.name in ("tool_work", "tool_wear") and f.name not in arrays:  # of a run before it was counted
                values[f.name] = np.zeros(0)
            elif f.name in NAMED:
                kind: Any = NAMED[f.name]
                values[f.name] = kind(*(arrays[f"{f.name}.{k}"].item() for k in kind._fields))
            else:
                values[f.name] = np.array(arrays[f.name])
        return cls(**values)


def _alike(new: Array, old: Array) -> float:
    """How far two differences (n,) are alike, 0 … 1: their product over the larger one's square."""
    size = max(float(old @ old), float(new @ new))
    return max(float(new @ old) / size, 0.0) if size > 0 else 0.0


def may_rest(state: State) -> bool:
    """Whether the softest modes were so far from turning that the next increment need not have a look at them."""
    known = state.stability
    return not known.negative and not known.viscosity > 0 and known.since < known.rest


def _as_arrays(derivatives: Mapping[str, Mapping[str, Array]]) -> dict[str, Stored]:
    """Derivatives as flat arrays, the paths of the parameters in one of them."""
    if not derivatives:
        return {}
    out: dict[str, Stored] = {"derivatives": np.frombuffer("\n".join(derivatives).encode(), dtype=np.uint8)}
    for i, of in enumerate(derivatives.values()):
        out |= {f"derivative_{i}.{name}": a for name, a in of.items()}
    return out


def _from_arrays(arrays: Mapping[str, Stored]) -> dict[str, dict[str, Array]]:
    """Inverse of `_as_arrays`."""
    if "derivatives" not in arrays:
        return {}
    out: dict[str, dict[str, Array]] = {}
    for i, path in enumerate(bytes(arrays["derivatives"]).decode().split("\n")):
        first = f"derivative_{i}."
        out[path] = {k.removeprefix(first): np.array(a) for k, a in arrays.items() if k.startswith(first)}
    return out


NAMED = {"clock": Clock, "energy": Energy, "stability": Stability}
