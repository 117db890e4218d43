"""Point functions are recorded as graphs when they are called with `Node`s.

A point function is plain Python on numbers: + - * /, comparisons, the functions below, tuples, loops, calls of other such
functions. Called with arrays, real or complex, it computes; that is what generated code is tested against, by the complex step.
Called with `Node`s it leaves a graph, which `prensa.kernels.differentiate` differentiates and `prensa.kernels.machine_code` makes
into machine code.

Equal expressions are recorded once, zeros and ones fold away. What is recorded after `fresh` depends on nothing before, so that
the same function gives the same graph, and the same key of the cache, in every process.

Why not a library: CasADi records and differentiates in the same way, but its own machine goes through operations one by one, and
its C code needs a compiler that users of wheels do not have. JAX has implicit derivatives and a compiler, but weighs a hundred
megabytes and promises no equal bits for a point alone and among others. Warp (390 MB; on 250 000 quadrilaterals as fast as
Numba) has the reverse mode alone. Enzyme for Numba has no wheels. SymPy and AceGen (which needs Mathematica) make source text
that has to be compiled. None looks up tables and finds roots by brackets in SIMD code. Ours stands on llvmlite, which Numba
brings along. These were judged by what is written of them; no kernel was ported to each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

Function = Callable[..., "Node"]

Value = float | str | tuple[str, int] | tuple[str, int, int] | None


class Node:
    """An operation of a graph: ``op``, the nodes that it is of, what else it needs; ``number``ed as they are recorded."""

    __slots__ = ("args", "number", "op", "value")

    def __init__(self, op: str, args: tuple[Node, ...], value: Value | Part, number: int) -> None:
        self.op, self.args, self.value, self.number = op, args, value, number

    def __add__(self, other: Node | float) -> Node:
        a, b = self, lift(other)
        if a.op == b.op == "const":
            return lift(_number(a) + _number(b))
        if a is ZERO or b is ZERO:
            return b if a is ZERO else a
        if b.op == "neg":
            return a - b.args[0]
        return b - a.args[0] if a.op == "neg" else node("+", a, b)

    def __sub__(self, other: Node | float) -> Node:
        a, b = self, lift(other)
        if a.op == b.op == "const":
            return lift(_number(a) - _number(b))
        if b is ZERO or a is b:
            return a if b is ZERO else ZERO
        if a is ZERO:
            return -b
        return a + b.args[0] if b.op == "neg" else node("-", a, b)

    def __mul__(self, other: Node | float) -> Node:
        if not isinstance(other, Node | Real):
            return NotImplemented  # of tensors, which multiply themselves
        a, b = self, lift(other)
        if a.op == b.op == "const":
            return lift(_number(a) * _number(b))
        if b.op == "const":
            a, b = b, a
        if a is ZERO or a is ONE:
            return ZERO if a is ZERO else b
        if a.op == "const" and a.value == -1.0:
            return -b
        if a.op == "neg":
            return -(a.args[0] * b)
        if b.op == "neg":
            return -(a * b.args[0])
        # One order for both factors: a b and b a are the same node, and the same bits.
        return node("*", a, b) if a.number <= b.number else node("*", b, a)

    def __truediv__(self, other: Node | float) -> Node:
        return self * inverse(lift(other))

    def __neg__(self) -> Node:
        if self.op == "const":
            return lift(-_number(self))
        return self.args[0] if self.op == "neg" else node("neg", self)

    def __radd__(self, other: float) -> Node:
        return lift(other) + self

    def __rsub__(self, other: float) -> Node:
        return lift(other) - self

    def __rmul__(self, other: float) -> Node:
        return lift(other) * self

    def __rtruediv__(self, other: float) -> Node:
        return lift(other) * inverse(self)

    def __pow__(self, exponent: Node | float) -> Node:
        return power(self, exponent)

    def __rpow__(self, base: float) -> Node:
        return exp(self * lift(np.log(base)))

    def __bool__(self) -> bool:
        raise TypeError("whether a recorded number is true is not known: write where(test, a, b) for 'a if test else b'")

    def __gt__(self, other: Node | float) -> Node:
        return node(">", self, lift(other))

    def __ge__(self, other: Node | float) -> Node:
        return node(">=", self, lift(other))

    def __lt__(self, other: Node | float) -> Node:
        return node(">", lift(other), self)

    def __le__(self, other: Node | float) -> Node:
        return node(">=", lift(other), self)

    def __and__(self, other: Node) -> Node:
        return node("and", self, other)

    def __or__(self, other: Node) -> Node:
        return node("or", self, other)

    def __invert__(self) -> Node:
        return node("not", self)


class Part(NamedTuple):
    """A function within a graph, with the graph of its own that it is of ``places`` for its arguments; ``smooth``: see `root`."""

    function: Function
    places: tuple[Node, ...]
    value: Node
    smooth: bool

    def __hash__(self) -> int:
        return hash(self[1:])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Part) and self[1:] == other[1:]


_kept: dict[tuple[str, tuple[Node, ...], Value | Part], Node] = {}
_depth = 0


def node(op: str, *args: Node, value: Value | Part = None) -> Node:
    """The operation of a name on nodes: that recorded before, or a new one."""
    key = op, args, value
    found = _kept.get(key)
    if found is None:
        found = _kept[key] = Node(op, args, value, len(_kept))
    return found


def lift(x: Node | float) -> Node:
    """A number as a node; zero has no sign."""
    return x if isinstance(x, Node) else node("const", value=float(x) + 0.0)


ZERO, ONE = lift(0.0), lift(1.0)


def fresh() -> None:
    """Forget what was recorded: graphs from here on have nodes of their own."""
    _kept.clear()
    for n in (ZERO, ONE):
        _kept[n.op, n.args, n.value] = n


def given(array: str, column: int) -> Node:
    """A number that is read: column of an array, see `prensa.kernels.emit`."""
    return node("given", value=(array, column))


def many(array: str, count: int, first: int = 0) -> list[Node]:
    """``count`` numbers that follow one another in an array."""
    return [given(array, first + k) for k in range(count)]


def _number(n: Node) -> float:
    assert isinstance(n.value, float)
    return n.value


def inverse(x: Node) -> Node:
    """1/x."""
    return lift(1.0 / _number(x)) if x.op == "const" else node("inverse", x)


def _function(name: str, plain: Callable[..., float]) -> Function:
    def f(x: Node) -> Node:
        if not isinstance(x, Node):
            return plain(x)
        return lift(plain(_number(x))) if x.op == "const" else node(name, x)

    f.__doc__ = f"The {name} of a number."
    return f


def _size(x: Any) -> Any:
    """|x|, of complex numbers what the size of the real part is continued by."""
    return np.where(np.real(x) < 0.0, -x, x)


sqrt, log, exp, absolute = (
    _function(name, plain) for name, plain in (("sqrt", np.sqrt), ("log", np.log), ("exp", np.exp), ("abs", _size))
)


TINY = 1e-12
"""Number below which a power of it is the chord from zero: a slope that is infinite there is finite."""


def power(x: Node, exponent: Node | float) -> Node:
    """X to an exponent ≥ 0, of x ≥ 0; below `TINY` its chord. Whole exponents up to four are products, of any x."""
    if exponent in (1, 2, 3, 4):
        half = x * x
        return (x, half, half * x, half * half)[int(exponent) - 1]
    below = x < TINY
    at = where(below, TINY, x)
    found = exp(exponent * log(at))
    return where(below, found * (x / at), found)


def where(test: Node, a: Node | float, b: Node | float) -> Node:
    """A where the test holds, else b: both are computed, so that what is not taken must not divide by zero or the like.

    Backwards its weight is zero, and zero times infinity is not a number.
    """
    if not isinstance(test, Node):
        return np.where(test, a, b)
    a, b = lift(a), lift(b)
    return a if a is b else node("where", test, a, b)


def differs(a: Node, b: Node | float) -> Node:
    """Whether two numbers are not the same."""
    return node("!=", a, lift(b)) if isinstance(a, Node) else np.real(a) != np.real(b)


def damped(x: Node, share: Node) -> Node:
    """A number whose derivatives count with a ``share``: tangents that leave out part of what they know."""
    return node("damped", x, lift(share)) if isinstance(x, Node) else x


def local(values: Sequence[Node], at: Sequence[Node]) -> list[Node]:
    """Values that depend on what is sought through ``at`` alone: forwards, their Jacobian comes first, then the chain rule."""
    if not any(isinstance(v, Node) for v in values):
        return list(values)
    some = [a for a in at if isinstance(a, Node) and a.op != "const"]
    return [node("local", v, *some) for v in values]


def answered(value: Node, at: Sequence[Node], slopes: Sequence[Node]) -> Node:
    """A value that something else has found at some numbers, with its derivatives by them."""
    return node("answered", value, *at, *slopes)


def constant(value: Node) -> Node:
    """A value without derivatives."""
    return answered(value, [], []) if isinstance(value, Node) else value


def as_found(value: Node, graph: Node) -> Node:
    """A value that was found before, or in another way, with the derivatives of the graph that found it."""
    return value if not isinstance(value, Node) else answered(value, [graph], [ONE])


def part(function: Function, count: int, smooth: bool = True) -> Part:
    """A function recorded by itself, of ``count`` arguments."""
    global _depth
    _depth += 1
    try:
        places = tuple(node("given", value=("place", _depth, k)) for k in range(count))
        return Part(function, places, lift(function(*places)), smooth)
    finally:
        _depth -= 1


def either(test: Node, often: Function, seldom: Function, *args: Node) -> Node:
    """seldom(*args) where the test holds, else often(*args); machine code runs the former where some lane needs it alone."""
    if not isinstance(test, Node):
        with np.errstate(all="ignore"):
            return np.where(test, seldom(*args), often(*args))
    args = tuple(map(_whole, args))
    return node("either", test, lift(often(*args)), *args, value=part(seldom, len(args)))


def _whole(x: Node | float) -> Node:
    """A number by which something is differentiated: minus something would fold into what it is an argument of."""
    x = lift(x)
    return node("local", x, x) if x.op == "neg" else x


def one_like(x: Node) -> Node:
    """One, of the same kind of number."""
    return ONE if isinstance(x, Node) else x * 0.0 + 1.0


SEARCH_STEPS = 200  # of a search for a root; few take more than four
# A weaker test saves a step at points that begin to flow, but their slopes are then right to 1e-10 only.
LAST_STEP_SMOOTH, LAST_STEP_KINKED = 1e-5, 1e-8
"""Newton's last step over the root: what Halley's errs by is the third power of it, or where there are kinks the second."""
LEFT_OVER = 2e-14  # residual over its scale: what is left is round-off
BRACKET = 4e-16  # width of the bracket over the root
NO_ROOT = 1e-8  # residual over its scale in so narrow a bracket, above which it is a jump or the end of where it was looked for


def root(
    residual: Function, active: Node, start: Node, low: Node, high: Node, scale: Node, *args: Node, smooth: bool = True
) -> Node:  # fmt: skip
    """X between low and high with residual(x, *args) = 0, falling in x; 0 where not ``active``, NaN where none is found.

    Halley's steps (1694) until they are round-off, for curves with kinks (not ``smooth``) until Newton's would be; a bracket
    takes over where a step leaves it. ``scale``: size of the terms of the residual. The derivative is that of the equation: no
    iteration is differentiated.
    """
    if any(isinstance(a, Node) for a in (active, start, *args)):
        own = part(residual, len(args) + 1, smooth)
        return node("root", active, *map(lift, (start, low, high, scale)), *map(_whole, args), value=own)
    return _plain_root(residual, active, start, low, high, scale, *args)


ROOT_ARGUMENTS = 5
"""Arguments of a root before those of its residual."""


def _plain_root(
    residual: Callable[..., Any], active: Any, start: Any, low: Any, high: Any, scale: Any, *args: Any
) -> Any:  # fmt: skip
    """As `root`, of arrays: by bisection and Newton's method of real numbers; one step of complex ones has their derivative."""
    real = [np.real(a) for a in args]

    def slope(x: Any) -> Any:
        size = np.abs(x) + 1e-9
        return np.imag(residual(x + 1e-30j * size, *real)) / (1e-30 * size)

    with np.errstate(all="ignore"):
        x, low, high = (np.real(v) + np.zeros(np.shape(active)) for v in (start, low, high))
        for _ in range(SEARCH_STEPS):
            r = residual(x, *real)
            low, high = np.where(r > 0.0, x, low), np.where(r > 0.0, high, x)
            then = x - r / slope(x)
            x = np.where((then >= low) & (then <= high), then, 0.5 * (low + high))
        x = np.where(np.abs(residual(x, *real)) <= 1e-10 * np.real(scale), x, np.nan)
        x = x - residual(x, *args) / slope(x)
    return np.where(active, x, 0.0)


def piece(a: Any, knots: Any) -> Any:
    """Number of the piece of a table in which a lies, by its knots: an array, or the name of one of a kernel."""
    if isinstance(knots, str):
        return node("piece", a, value=knots)
    return np.clip(np.searchsorted(knots, np.real(a), side="right") - 1, 0, len(knots) - 2)


def cell(number: Any, array: Any, width: int, column: int) -> Any:
    """A column of the row of an array (k, width) that belongs to a piece."""
    if isinstance(array, str):
        return node("cell", number, value=(array, width, column))
    return array.reshape(-1, width)[number, column]
