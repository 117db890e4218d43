"""Numbers of an increment by name, for sweeps, convergence studies and the command line.

====================================  ==================================================================================
``force.<tool>.x|y|m``                force and moment of the bodies on a tool
``place.<tool>.x|y|rz``               displacement and rotation of a tool
``area.<contact>``                    tributary area of the closed points
``max.pressure|shear|slip.<contact>`` largest value along a contact (``shear`` in absolute value)
``min.gap.<contact>``                 smallest gap (negative: penetration)
``count.open|stick|slip.<contact>``   number of points
``max.mises|plastic_strain``          over all bodies, or ``max.mises.<body>`` over one
``min|max.thickness``                 in plane stress, over all bodies or one
``max.displacement``                  largest length of a nodal displacement, also per body
``energy.<part>``                     entry of the ledger
``mean|ripple.<column>``              over the last element that passed (`prensa.solver.passages`): of a column of
                                      ``history.csv`` as ``mean.die.fx``, or of ``<contact>.pressure``
``passages|elements.<contact>``       elements that have passed, and that lie in the contact
``time``, ``iterations``, ``cutbacks``, ``residual``
====================================  ==================================================================================

A contact's name may be left out when there is only one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from prensa.errors import PrensaError, take
from prensa.model.names import suggest
from prensa.solver.increment import STATUS, BodyState, ContactState, Increment

Getter = Callable[[], float]


def measure(increment: Increment, name: str) -> float:
    """Value of the measure *name* of *increment*, as in ``measure(increment, "force.cylinder.y")``.

    Raises
    ------
    PrensaError
        If there is no such measure; the message suggests the nearest one.

    """
    take("measure", "increment", increment, Increment, "give what solve yields")
    take("measure", "name", name, str, "give the name of a measure, such as 'max.mises'")
    known = dict(_measures(increment))
    if name not in known:
        raise PrensaError(f"unknown measure {name!r}{suggest(name, known)}")
    return float(known[name]())


def measures(increment: Increment) -> tuple[str, ...]:
    """Names of all the measures of *increment*."""
    take("measures", "increment", increment, Increment, "give what solve yields")
    return tuple(dict(_measures(increment)))


def _measures(increment: Increment) -> Iterator[tuple[str, Getter]]:
    """Names and how to compute them: nothing is recovered until it is asked for."""
    for name, tool in increment.tools.items():
        for c in tool.force._fields:
            yield f"force.{name}.{c}", _later(getattr, tool.force, c)
        for c in tool.place._fields:
            yield f"place.{name}.{c}", _later(getattr, tool.place, c)
    for column, mean in increment.means.items():
        yield f"mean.{column}", _later(getattr, mean, "mean")
        yield f"ripple.{column}", _later(getattr, mean, "ripple")
    contacts = list(increment.contacts.items())
    for name, passing in increment.passing.items():
        for suffix in (f".{name}", "") if len(contacts) == 1 else (f".{name}",):
            yield f"passages{suffix}", _later(float, increment.passages[name])
            yield f"elements{suffix}", _later(getattr, passing, "elements")
    for name, contact in contacts:
        yield from _of_contact(contact, f".{name}")
    if len(contacts) == 1:
        yield from _of_contact(contacts[0][1], "")
    names = list(increment.bodies)
    yield from _of_bodies(increment, names, "")
    for name in names:
        yield from _of_bodies(increment, [name], f".{name}")
    for part in increment.energy:
        yield f"energy.{part}", _later(increment.energy.__getitem__, part)
    yield "time", lambda: increment.time
    for c in ("iterations", "cutbacks", "residual"):
        yield c, _later(getattr, increment.statistics, c)


def _of_contact(contact: ContactState, suffix: str) -> Iterator[tuple[str, Getter]]:
    yield f"area{suffix}", lambda: contact.area
    for field in ("pressure", "shear", "slip"):
        yield f"max.{field}{suffix}", _later(lambda f: np.abs(getattr(contact, f)).max(initial=0.0), field)
    yield f"min.gap{suffix}", lambda: contact.gap.min(initial=np.inf)
    for i, word in enumerate(STATUS):
        yield f"count.{word}{suffix}", _later(lambda k: float(np.count_nonzero(contact.status == k)), i)


def _of_bodies(increment: Increment, names: list[str], suffix: str) -> Iterator[tuple[str, Getter]]:
    def largest(field: Callable[[BodyState], np.ndarray]) -> Getter:
        return lambda: max(float(field(increment.bodies[n]).max(initial=0.0)) for n in names)

    yield f"max.mises{suffix}", largest(lambda b: b.mises)
    yield f"max.plastic_strain{suffix}", largest(lambda b: b.plastic_strain)
    thin = [t for n in names if (t := increment.bodies[n].thickness) is not None]
    if thin:
        yield f"max.thickness{suffix}", lambda: max(float(t.max()) for t in thin)
        yield f"min.thickness{suffix}", lambda: min(float(t.min()) for t in thin)
    yield f"max.displacement{suffix}", largest(lambda b: np.hypot(b.displacement[:, 0], b.displacement[:, 1]))


def _later(function: Callable[..., float], *arguments: object) -> Getter:
    return lambda: function(*arguments)
