"""Derivatives of recorded graphs, as graphs again: along directions and backwards, through Jacobians of parts and roots.

One table, `slopes`, has all that is known of an operation (Griewank and Walther 2008, ch. 3).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from prensa.kernels.record import ONE, ROOT_ARGUMENTS, ZERO, Function, Node, Part, inverse, lift, node, part, where

Sources = Callable[[Node], Sequence[Node]]
CONSTANT = {"const", "given", ">", ">=", "!=", "and", "or", "not", "piece", "cell"}
"""What has no derivative but one that it is given."""


def slopes(n: Node, locals_: bool = True) -> list[tuple[Node, Node]]:
    """Arguments of a node with the derivatives by them; without ``locals_`` a local value is what it stands for."""
    a = n.args
    match n.op:
        case "+":
            return [(a[0], ONE), (a[1], ONE)]
        case "-":
            return [(a[0], ONE), (a[1], -ONE)]
        case "*":
            return [(a[0], a[1]), (a[1], a[0])]
        case "neg":
            return [(a[0], -ONE)]
        case "inverse":
            return [(a[0], -(n * n))]
        case "sqrt":
            return [(a[0], 0.5 * inverse(n))]
        case "log":
            return [(a[0], inverse(a[0]))]
        case "exp":
            return [(a[0], n)]
        case "abs":
            return [(a[0], where(a[0] > ZERO, ONE, -ONE))]
        case "damped":
            return [(a[0], a[1])]
        case "answered":
            k = len(a) // 2 + 1
            return list(zip(a[1:k], a[k:]))
        case "local":
            if not locals_:
                return [(a[0], ONE)]
            return list(zip(a[1:], forward([a[0]], units(a[1:]), len(a) - 1)[0]))
        case "either":
            test, near, *inner = a
            assert isinstance(n.value, Part)
            often = forward([near], units(inner), len(inner))[0]
            return [(x, _either_slope(n.value, test, d, inner, k)) for k, (x, d) in enumerate(zip(inner, often))]
        case "root":
            # r(x, a) = 0: x' = −(∂r/∂a a')/(∂r/∂x)
            active, args = a[0], a[ROOT_ARGUMENTS:]
            assert isinstance(n.value, Part)
            by, *others = forward([n.value.function(n, *args)], units((n, *args)), len(args) + 1)[0]
            # Where nothing is sought the slope may vanish; the inner branch keeps its inverse finite.
            over = where(active, -inverse(where(active, by, ONE)), ZERO)
            return [(x, d * over) for x, d in zip(args, others)]
    raise TypeError(n.op)


def _either_slope(seldom: Part, test: Node, often: Node, inner: Sequence[Node], k: int) -> Node:
    """Derivative by argument k of what is computed in one way or another: that way's derivative."""

    def slope(*places: Node) -> Node:
        return forward([lift(seldom.function(*places))], {places[k]: [ONE]}, 1)[0][0]

    return node("either", test, often, *inner, value=part(slope, len(inner)))


def units(nodes: Sequence[Node]) -> dict[Node, list[Node]]:
    """Seeds of the directions along each of some nodes."""
    return {x: [ONE if j == k else ZERO for j in range(len(nodes))] for k, x in enumerate(nodes)}


def _sources(n: Node, locals_: bool) -> tuple[Node, ...]:
    """Arguments through which a derivative comes."""
    match n.op:
        case "root":
            return n.args[ROOT_ARGUMENTS:]
        case "either":
            return n.args[2:]
        case "where":
            return n.args[1:]
        case "damped":
            return n.args[:1]
        case "answered":
            return n.args[1 : len(n.args) // 2 + 1]
        case "local":
            return n.args[1:] if locals_ else n.args[:1]
    return n.args


def forward(
    outputs: Sequence[Node | float], seeds: Mapping[Node, Sequence[Node]], m: int, locals_: bool = True
) -> list[list[Node]]:  # fmt: skip
    """Derivatives (…, m) of outputs along m directions at once, which share what there is of values; ``seeds`` of inputs."""
    known: dict[Node, Sequence[Node] | None] = dict(seeds)
    for n in reach([lift(o) for o in outputs], lambda n: () if n in seeds or n.op in CONSTANT else _sources(n, locals_)):
        if n in known:
            continue
        d: Sequence[Node] | None = None
        if n.op == "where":
            yes, no = known[n.args[1]], known[n.args[2]]
            if yes is not None or no is not None:
                d = [where(n.args[0], p, q) for p, q in zip(yes or [ZERO] * m, no or [ZERO] * m)]
        elif n.op not in CONSTANT and any(known[x] is not None for x in _sources(n, locals_)):
            if n.op == "local" and locals_:
                _check_local(n, seeds)
            for x, by in slopes(n, locals_):
                if (dx := known[x]) is not None:
                    d = [by * p + q for p, q in zip(dx, d or [ZERO] * m)]
        known[n] = d
    return [list(known[lift(o)] or [ZERO] * m) for o in outputs]


def _check_local(n: Node, seeds: Mapping[Node, Sequence[Node]]) -> None:
    """Raise ValueError where a local value depends on what is sought in more ways than it says."""
    at = n.args[1:]
    inside = reach(n.args[:1], lambda x: () if x in at or x.op in CONSTANT else _sources(x, False))
    if any(x in seeds and x not in at for x in inside):
        raise ValueError("a local value depends on more of what is sought than it names")


def reverse(outputs: Sequence[Node | float], weights: Sequence[Node], wanted: Sequence[Node]) -> list[Node]:
    """Σ weight × output, differentiated by each of what is wanted, at the price of a few evaluations."""
    stop = set(wanted)
    order = reach([lift(o) for o in outputs], lambda n: () if n in stop or n.op in CONSTANT else _sources(n, False))
    live = set(wanted)
    for n in order:
        if n.op not in CONSTANT and any(x in live for x in _sources(n, False)):
            live.add(n)
    bar: dict[Node, Node] = {}
    for o, w in zip(outputs, weights):
        bar[lift(o)] = bar.get(lift(o), ZERO) + w
    for n in reversed(order):
        w = bar.get(n, ZERO)
        if n in stop or n.op in CONSTANT or w is ZERO or n not in live:
            continue
        # The branch that is not taken gets the weight zero, and must be finite for that: zero times infinity is not a number.
        if n.op == "where":
            shares = [(n.args[1], where(n.args[0], w, ZERO)), (n.args[2], where(n.args[0], ZERO, w))]
        else:
            shares = [(source, by * w) for source, by in slopes(n, False)]
        for source, share in shares:
            if source in live:
                bar[source] = bar.get(source, ZERO) + share
    return [bar.get(x, ZERO) for x in wanted]


def reach(outputs: Iterable[Node], sources: Sources) -> list[Node]:
    """All nodes that outputs have in ``sources``, arguments first."""
    seen: set[Node] = set()
    stack = list(outputs)
    while stack:
        n = stack.pop()
        if n not in seen:
            seen.add(n)
            stack += sources(n)
    # A node is recorded after its arguments, so numbers are a topological order.
    return sorted(seen, key=lambda n: n.number)


def slope_of(f: Function, x: Node) -> tuple[Node, Node]:
    """First and second derivative of a function of one number: exact ones, of arrays by differences."""
    if isinstance(x, Node):
        # A node of its own: what f does with x counts, not what x is made of.
        at = node("local", x)
        first = forward([f(at)], {at: [ONE]}, 1)[0][0]
        return first, forward([first], {at: [ONE]}, 1)[0][0]
    h = 1e-6 * (np.abs(x) + 1e-3)
    low, mid, high = f(x - h), f(x), f(x + h)
    return (high - low) / (2.0 * h), (high - 2.0 * mid + low) / (h * h)
