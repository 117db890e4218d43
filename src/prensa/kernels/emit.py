"""Graphs → SIMD instructions that answer for `WIDE` rows of arrays at once; `prensa.kernels.machine_code` compiles them.

A kernel reads numbers of rows (points, or elements with points of their own), computes, and writes numbers of the same rows.
Eight rows go side by side through explicit SIMD instructions, so that neither a loop vectoriser nor an inference of types sees
graphs of thousands of operations. A last, incomplete group is padded by repeating the last row: what a row answers depends
neither on its place nor on threads. A product that is added to something is always added in one operation, whatever else is
computed beside it: a residual has the same bits with and without its tangent. No flag of fast arithmetic is set, which would
leave that to the compiler; no-NaN and no-infinity would delete the tests by which points fail.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from llvmlite import ir

from prensa.kernels.differentiate import forward
from prensa.kernels.lanes import WIDE, load, store, transposed
from prensa.kernels.record import (
    BRACKET,
    LAST_STEP_KINKED,
    LAST_STEP_SMOOTH,
    LEFT_OVER,
    NO_ROOT,
    ONE,
    ROOT_ARGUMENTS,
    SEARCH_STEPS,
    Node,
    Part,
    given,
    lift,
)

_D, _L, _S, _B = ir.DoubleType(), ir.IntType(64), ir.IntType(32), ir.IntType(8)
_V, _VL, _VB = ir.VectorType(_D, WIDE), ir.VectorType(_L, WIDE), ir.VectorType(ir.IntType(1), WIDE)


class Rows(NamedTuple):
    """An array with a row of so many numbers for each row of the kernel, or with ``points`` of them one after the other.

    With ``directions`` each number is one of every direction, beside one another: the last axis of the array.
    """

    columns: int
    points: bool = False
    directions: bool = False


class Shared(NamedTuple):
    """An array of numbers that all rows share; with ``columns`` so many for each point, one after the other."""

    columns: int = 0
    directions: bool = False


class Marks(NamedTuple):
    """An array of bytes, one for each row, or for each point of each row."""

    points: bool = False


Kind = Rows | Shared | Marks


class Put(NamedTuple):
    """A number that is written: node → column of an array."""

    array: str
    column: int
    node: Node


def puts(array: str, nodes: Iterable[Node], first: int = 0) -> list[Put]:
    """Nodes → columns of an array that follow one another."""
    return [Put(array, first + k, lift(n)) for k, n in enumerate(nodes)]


def total(k: int) -> Node:
    """The sum over the points of a row of number k of a kernel's ``sums``."""
    return given("total", k)


class Program(NamedTuple):
    """What a kernel computes: ``puts``, of numbers ``given`` by its arrays and of `total`s; ``points`` of a row, 0 for none.

    Where arrays have directions, what follows from them is computed of one after the other, of as many as there are, and all else
    once. The sums belong to directions then.
    """

    arrays: Mapping[str, Kind]
    puts: Sequence[Put]
    sums: Sequence[Node] = ()
    points: int = 0


# --- numbers of machine code ------------------------------------------------------------------------------------------


def _both(x: float) -> Any:
    return ir.Constant(_V, [float(x)] * WIDE)


def _longs(x: int) -> Any:
    return ir.Constant(_VL, [x] * WIDE)


def _fused(b: Any, x: Any, y: Any, z: Any) -> Any:
    """X y + z in one operation where the processor has it."""
    name = f"llvm.fmuladd.v{WIDE}f64"
    f = b.module.globals.get(name) or ir.Function(b.module, ir.FunctionType(_V, [_V] * 3), name)
    return b.call(f, [x, y, z])


class _Number:
    """A vector with operators; ``factors`` of a product."""

    def __init__(self, b: Any, v: Any, factors: tuple[Any, Any] | None = None) -> None:
        self.b, self.v, self.factors = b, v, factors

    def _of(self, other: _Number | float) -> _Number:
        return other if isinstance(other, _Number) else _Number(self.b, _both(other))

    def __add__(self, other: _Number | float) -> _Number:
        a, c = self, self._of(other)
        if c.factors is not None:
            a, c = c, a
        return _Number(self.b, self.b.fadd(a.v, c.v) if a.factors is None else _fused(self.b, *a.factors, c.v))

    def __sub__(self, other: _Number | float) -> _Number:
        return self + -self._of(other)

    def __mul__(self, other: _Number | float) -> _Number:
        factors = self.v, self._of(other).v
        return _Number(self.b, self.b.fmul(*factors), factors)

    def __truediv__(self, other: _Number | float) -> _Number:
        return _Number(self.b, self.b.fdiv(self.v, self._of(other).v))

    def __neg__(self) -> _Number:
        factors = None if self.factors is None else (self.b.fneg(self.factors[0]), self.factors[1])
        return _Number(self.b, self.b.fneg(self.v), factors)

    def compared(self, how: str, other: _Number | float) -> Any:
        """A vector of flags; false where one is not a number."""
        return self.b.fcmp_ordered(how, self.v, self._of(other).v)


_LN2, _LN2_REST = 0.69314718036912381649, 1.9082149292705877e-10  # ln 2 in two parts
_LEAST_NORMAL, _MOST = 2.2250738585072014e-308, 1.7976931348623157e308
_EXP_LEAST, _EXP_MOST = -708.0, 709.0  # between which e^x is a normal number
_WHOLE = 6755399441055744.0  # rounds to whole numbers when it is added
_LOG_TAIL = (
    0.1479819860511658591, 0.1531383769920937332, 0.1818357216161805012, 0.2222219843214978396, 0.2857142874366239149,
    0.3999999999940941908, 0.6666666666666735130,
)  # fmt: skip


def _log(b: Any, v: Any) -> Any:
    """Logarithm after fdlibm (Sun Microsystems 1993, e_log.c); no number of what is not positive, normal and finite."""
    bits = b.bitcast(v, _VL)
    # Exponent k and x = v/2ᵏ between √½ and √2, taken from the bits.
    over = b.ashr(b.sub(bits, _longs(0x3FE6A09E667F3BCD)), _longs(52))  # the bits of ½√2
    k, x = _Number(b, b.sitofp(over, _V)), _Number(b, b.bitcast(b.sub(bits, b.shl(over, _longs(52))), _V))
    f = x - 1.0
    s, half = f / (f + 2.0), f * f * 0.5
    z = s * s
    t = z * _LOG_TAIL[0]
    for c in _LOG_TAIL[1:]:
        t = (t + c) * z
    # k times the first part of ln 2 is exact; its rest goes with the small terms, which are added first.
    found = -(half - (s * (half + t) + k * _LN2_REST) - f) + k * _LN2
    good = b.and_(_Number(b, v).compared(">=", _LEAST_NORMAL), _Number(b, v).compared("<=", _MOST))
    return b.select(good, found.v, _both(math.nan))


def _exp(b: Any, v: Any) -> Any:
    """e^x by powers of two and a series; 0 and infinity where it is no normal number."""
    x = _Number(b, v)
    n = x * (1.0 / (_LN2 + _LN2_REST)) + _WHOLE
    whole = n - _WHOLE
    t = (x - whole * _LN2) - whole * _LN2_REST
    p = t * (1.0 / math.factorial(13)) + 1.0 / math.factorial(12)
    for k in range(11, 1, -1):
        p = p * t + 1.0 / math.factorial(k)
    # The bits of 1.5 · 2⁵² + n end with n as a whole number: shifted into the exponent they are 2ⁿ.
    scale = b.bitcast(b.shl(b.add(b.bitcast(n.v, _VL), _longs(1023 - 0x4338000000000000)), _longs(52)), _V)
    found = (t * t * p + t + 1.0) * _Number(b, scale)
    small, large = x.compared("<", _EXP_LEAST), x.compared(">", _EXP_MOST)
    return b.select(small, _both(0.0), b.select(large, _both(math.inf), found.v))


def _call(b: Any, name: str, v: Any) -> Any:
    name = f"{name}.v{WIDE}f64"
    f = b.module.globals.get(name) or ir.Function(b.module, ir.FunctionType(_V, [_V]), name)
    return b.call(f, [v])


def _any(b: Any, flags: Any) -> Any:
    """Whether one of a vector of flags is set."""
    return b.icmp_unsigned("!=", b.bitcast(flags, ir.IntType(WIDE)), ir.Constant(ir.IntType(WIDE), 0))


# --- graphs -----------------------------------------------------------------------------------------------------------


def _arguments(n: Node) -> tuple[Node, ...]:
    """Arguments that have to be computed before a node."""
    return n.args[:1] if n.op in ("local", "damped", "answered") else n.args


def demanded(outputs: Iterable[Node]) -> list[Node]:
    """All nodes that outputs need, each just before it is first wanted."""
    order: list[Node] = []
    seen: set[Node] = set()
    for o in outputs:
        stack = [(o, iter(_arguments(o)))] if o not in seen else []
        seen.add(o)
        while stack:
            n, left = stack[-1]
            for x in left:
                if x not in seen:
                    seen.add(x)
                    stack.append((x, iter(_arguments(x))))
                    break
            else:
                order.append(n)
                stack.pop()
    return order


def described(n: Node, numbers: Mapping[Node, int]) -> str:
    """A node in words: what differs in them is computed otherwise."""
    value = n.value
    if isinstance(value, Part):
        inner = demanded([value.value])
        own = {x: k for k, x in enumerate(inner)}
        value = f"{value.smooth} {[p.value for p in value.places]} {'; '.join(described(x, own) for x in inner)}"
    elif isinstance(value, float):
        # In hexadecimal every bit of a number counts for the key.
        value = value.hex()
    return f"{n.op} {[numbers[x] for x in _arguments(n)]} {value}"


LONGEST_BLOCK = 1000
"""Instructions after which a block of them ends."""


class _Emitter:
    """Instructions of a kernel; ``tables``: where arrays begin that are read by pieces, with the number of their rows."""

    def __init__(self, b: Any, tables: Mapping[str, tuple[Any, Any]], goes_on: Any, never: Any) -> None:
        self.b, self.tables = b, tables
        self.goes_on, self.never = goes_on, never
        self.directed, self.directions, self.direction = frozenset[str](), None, None

    def now_and_then(self) -> None:
        """End a block of instructions that has become long, and begin another.

        LLVM orders the instructions of a block in a time that grows with the square of their number. Blocks that always follow
        one another it makes one: it does not know that the flag ``goes_on`` is always set, and the block ``never`` not reached.
        """
        if len(self.b.block.instructions) > LONGEST_BLOCK:
            after = self.b.append_basic_block("on")
            self.b.cbranch(self.goes_on, after, self.never)
            self.b.position_at_end(after)

    def all(self, nodes: Iterable[Node], known: dict[Node, Any]) -> None:
        """Instructions of nodes in order → known, vectors by node."""
        for n in nodes:
            if n not in known:
                self.now_and_then()
                a = [known[x] for x in _arguments(n)]
                known[n] = self._added(n, a, known) if n.op in ("+", "-") else self._one(n, a)

    def _added(self, n: Node, a: Sequence[Any], known: Mapping[Node, Any]) -> Any:
        numbers = [_Number(self.b, v, self._factors(x, known)) for x, v in zip(n.args, a)]
        return (numbers[0] + numbers[1] if n.op == "+" else numbers[0] - numbers[1]).v

    def _factors(self, n: Node, known: Mapping[Node, Any]) -> tuple[Any, Any] | None:
        return (known[n.args[0]], known[n.args[1]]) if n.op == "*" else None

    def _one(self, n: Node, a: Sequence[Any]) -> Any:
        b = self.b
        match n.op:
            case "const":
                assert isinstance(n.value, float)
                return _both(n.value)
            case "*":
                return b.fmul(*a)
            case "neg":
                return b.fneg(a[0])
            case "inverse":
                return b.fdiv(_both(1.0), a[0])
            case "sqrt" | "abs":
                return _call(b, "llvm.sqrt" if n.op == "sqrt" else "llvm.fabs", a[0])
            case "log":
                return _log(b, a[0])
            case "exp":
                return _exp(b, a[0])
            case ">" | ">=":
                return b.fcmp_ordered(n.op, *a)
            case "!=":
                # Unordered, so that NaN differs from itself: failed points are found by that.
                return b.fcmp_unordered("!=", *a)
            case "and":
                return b.and_(*a)
            case "or":
                return b.or_(*a)
            case "not":
                return b.not_(a[0])
            case "where":
                return b.select(*a)
            case "local" | "damped" | "answered":
                return a[0]
            case "either":
                assert isinstance(n.value, Part)
                return self._either(n.value, a[0], a[1], a[2:])
            case "root":
                assert isinstance(n.value, Part)
                return self._root(n.value, a)
            case "piece":
                return self._piece(str(n.value), a[0])
            case "cell":
                assert isinstance(n.value, tuple)
                return self._cell(a[0], *n.value)
        raise TypeError(n.op)

    def _either(self, part: Part, test: Any, often: Any, args: Sequence[Any]) -> Any:
        b = self.b
        before, seldom, after = b.block, b.append_basic_block("seldom"), b.append_basic_block("either")
        b.cbranch(_any(b, test), seldom, after)
        b.position_at_end(seldom)
        known = dict(zip(part.places, args))
        self.all(demanded([part.value]), known)
        found = b.select(test, known[part.value], often)
        last = b.block
        b.branch(after)
        b.position_at_end(after)
        out = b.phi(_V)
        out.add_incoming(often, before)
        out.add_incoming(found, last)
        return out

    def _root(self, part: Part, a: Sequence[Any]) -> Any:
        """See `root`: all lanes until the last one is there."""
        b, (active, start, low, high, scale) = self.b, a[:ROOT_ARGUMENTS]
        unknown = part.places[0]
        slope = forward([part.value], {unknown: [ONE]}, 1)[0][0]
        curvature = forward([slope], {unknown: [ONE]}, 1)[0][0]
        before, loop, after = b.block, b.append_basic_block("search"), b.append_basic_block("found")
        b.cbranch(_any(b, active), loop, after)
        b.position_at_end(loop)
        x_now, lo_now, hi_now, left, turn = (b.phi(t) for t in (_V, _V, _V, _VB, _L))
        begins = (start, low, high, active, ir.Constant(_L, 0))
        for phi, value in zip((x_now, lo_now, hi_now, left, turn), begins):
            phi.add_incoming(value, before)
        known = {unknown: x_now} | dict(zip(part.places[1:], a[ROOT_ARGUMENTS:]))
        self.all(demanded([part.value, slope, curvature]), known)
        x, r, s, c = (_Number(b, v) for v in (x_now, known[part.value], known[slope], known[curvature]))
        # Halley's step is −r s/(s² − r c/2), Newton's −r/s.
        bent = s * s - r * c * 0.5
        inverse = -r / (s * bent)  # one division for Newton's and Halley's step
        newton, then = inverse * bent, x + inverse * s * s
        size = _Number(b, _call(b, "llvm.fabs", x.v))
        last_step = LAST_STEP_SMOOTH if part.smooth else LAST_STEP_KINKED
        near = _Number(b, _call(b, "llvm.fabs", newton.v)).compared("<=", size * last_step)
        # The residual falls in x: where it is positive the root lies above.
        above = r.compared(">", 0.0)
        lo, hi = _Number(b, b.select(above, x.v, lo_now)), _Number(b, b.select(above, hi_now, x.v))
        over, of = _Number(b, _call(b, "llvm.fabs", r.v)), _Number(b, scale)
        rest = over.compared("<=", of * LEFT_OVER)
        # A bracket may close on a jump, or on the end of where the root was sought: no root, which goes on until it is NaN.
        narrow = b.and_((hi - lo).compared("<=", size * BRACKET), over.compared("<=", of * NO_ROOT))
        ends = b.or_(near, b.or_(rest, narrow))
        inside = b.and_(then.compared(">", lo), then.compared("<", hi))
        go_on = b.select(inside, then.v, ((lo + hi) * 0.5).v)
        new = b.select(b.or_(near, b.not_(ends)), b.select(near, then.v, go_on), x.v)
        new = b.select(left, new, x.v)
        still = b.and_(left, b.not_(ends))
        for phi, value in zip((x_now, lo_now, hi_now, left, turn), (new, lo.v, hi.v, still, b.add(turn, ir.Constant(_L, 1)))):
            phi.add_incoming(value, b.block)
        more = b.and_(_any(b, still), b.icmp_signed("<", turn, ir.Constant(_L, SEARCH_STEPS)))
        found = b.select(active, b.select(still, _both(math.nan), new), _both(0.0))
        last = b.block
        b.cbranch(more, loop, after)
        b.position_at_end(after)
        out = b.phi(_V)
        out.add_incoming(_both(0.0), before)
        out.add_incoming(found, last)
        return out

    def _piece(self, knots: str, a: Any) -> Any:
        """Of each lane the number of the last knot but one that is not above it."""
        b, (base, count) = self.b, self.tables[knots]
        before, loop, after = b.block, b.append_basic_block("piece"), b.append_basic_block("there")
        last = b.sub(count, ir.Constant(_L, 1))
        b.cbranch(b.icmp_signed(">", last, ir.Constant(_L, 1)), loop, after)
        b.position_at_end(loop)
        # All knots are compared: a search by halves would go another way in each lane.
        k, place = b.phi(_L), b.phi(_VL)
        k.add_incoming(ir.Constant(_L, 1), before)
        place.add_incoming(_longs(0), before)
        up = b.zext(b.fcmp_ordered(">=", a, self.spread(b.load(b.gep(base, [k])))), _VL)
        found, then = b.add(place, up), b.add(k, ir.Constant(_L, 1))
        k.add_incoming(then, loop)
        place.add_incoming(found, loop)
        b.cbranch(b.icmp_signed("<", then, last), loop, after)
        b.position_at_end(after)
        out = b.phi(_VL)
        out.add_incoming(_longs(0), before)
        out.add_incoming(found, loop)
        return out

    def _cell(self, pieces: Any, array: str, width: int, column: int) -> Any:
        b, out = self.b, ir.Constant(_V, ir.Undefined)
        base = self.tables[array][0]
        for j in range(WIDE):
            lane = ir.Constant(_S, j)
            place = b.add(b.mul(b.extract_element(pieces, lane), ir.Constant(_L, width)), ir.Constant(_L, column))
            if array in self.directed:
                place = b.add(b.mul(place, self.directions), self.direction)
            out = b.insert_element(out, b.load(b.gep(base, [place])), lane)
        return out

    def place_of(self, column: int) -> Any:
        """Where the number of a column of the direction at hand stands among those of all directions."""
        return self.b.add(self.b.mul(ir.Constant(_L, column), self.directions), self.direction)

    def spread(self, number: Any) -> Any:
        """A number in all lanes."""
        b = self.b
        one = b.insert_element(ir.Constant(_V, ir.Undefined), number, ir.Constant(_S, 0))
        return b.shuffle_vector(one, one, ir.Constant(ir.VectorType(_S, WIDE), [0] * WIDE))


# --- kernels ----------------------------------------------------------------------------------------------------------


def _blocks(columns: Iterable[int], width: int) -> list[tuple[int, int]]:
    """First columns and widths of what is carried at a time, to have some of ``width`` columns, none beyond the last one."""
    out: list[tuple[int, int]] = []
    for c in sorted(set(columns)):
        if not any(first <= c < first + wide for first, wide in out):
            # The last block begins earlier instead of reaching beyond the row: what follows may be the end of the array.
            out.append((min(c - c % WIDE, max(width - WIDE, 0)), min(width, WIDE)))
    return out


def _column(n: Node) -> int:
    """Of what is given."""
    assert isinstance(n.value, tuple)
    assert isinstance(n.value[1], int)
    return n.value[1]


def _of_directions(kind: Kind) -> bool:
    return not isinstance(kind, Marks) and kind.directions


class _Writer:
    """One kernel's instructions."""

    def __init__(self, program: Program, name: str) -> None:
        self.program, self.module = program, ir.Module(name)
        function = ir.Function(self.module, ir.FunctionType(ir.VoidType(), [_L, _L.as_pointer()]), name)
        self.b = b = ir.IRBuilder(function.append_basic_block("entry"))
        count, table = function.args
        self.base, self.stride = {}, {}
        tables = {}
        for k, array in enumerate(program.arrays):
            header = b.load(b.gep(table, [ir.Constant(_L, k)]))
            data, axes, shape, strides = (self._field(header, i) for i in range(4))
            self.base[array], self.stride[array] = data, self._first(strides)
            tables[array] = b.inttoptr(data, _D.as_pointer()), self._first(shape)
            if _of_directions(program.arrays[array]):
                last = b.sub(b.trunc(axes, _S), ir.Constant(_S, 1))
                self.directions = b.load(b.gep(b.inttoptr(shape, _L.as_pointer()), [last]))
        never = b.append_basic_block("never")
        ir.IRBuilder(never).ret_void()
        self.emitter = _Emitter(b, tables, b.icmp_signed(">", count, ir.Constant(_L, 0)), never)
        self._rooms()
        self._groups(count)
        b.ret_void()

    def _rooms(self) -> None:
        """Memory for the sums over points."""
        self.room = self._vectors(ir.Constant(_L, max(len(self.program.sums), 1)))

    def _vectors(self, count: Any) -> Any:
        """Memory for so many vectors."""
        room = self.b.alloca(_V, count)
        room.align = 64
        return room

    def _field(self, header: Any, k: int) -> Any:
        """Field k of an array's header, a whole number."""
        return self._first(self.b.add(header, ir.Constant(_L, object.__basicsize__ + 8 * k)))

    def _first(self, address: Any) -> Any:
        """The whole number at an address."""
        return self.b.load(self.b.inttoptr(address, _L.as_pointer()))

    def _groups(self, count: Any) -> None:
        b = self.b
        before, loop, after = b.block, b.append_basic_block("rows"), b.append_basic_block("end")
        b.cbranch(b.icmp_signed(">", count, ir.Constant(_L, 0)), loop, after)
        b.position_at_end(loop)
        first = b.phi(_L)
        first.add_incoming(ir.Constant(_L, 0), before)
        last = b.sub(count, ir.Constant(_L, 1))
        self.rows = []
        for j in range(WIDE):
            row = b.add(first, ir.Constant(_L, j))
            self.rows.append(b.select(b.icmp_signed("<", row, last), row, last))
        self._group()
        then = b.add(first, ir.Constant(_L, WIDE))
        first.add_incoming(then, b.block)
        b.cbranch(b.icmp_signed("<", then, count), loop, after)
        b.position_at_end(after)

    def _group(self) -> None:
        b, p, known = self.b, self.program, dict[Node, Any]()
        phases = self._phases()
        if not p.points:
            self._read(phases[0], known, None)
            self.emitter.all(phases[0], known)
            self._write(p.puts, known, None)
            return
        self._read(phases[0], known, None)
        self.emitter.all(phases[0], known)
        for k in range(len(p.sums)):
            b.store(_both(0.0), self._sum(k), align=64)
        before, loop, after = b.block, b.append_basic_block("points"), b.append_basic_block("whole")
        b.branch(loop)
        b.position_at_end(loop)
        q = b.phi(_L)
        q.add_incoming(ir.Constant(_L, 0), before)
        inside = dict(known)
        self._read(phases[1], inside, q)
        self._add(phases[1], inside)
        pointwise = [x for x in p.puts if self._has_points(x.array)]
        self._write(pointwise, inside, q)
        then = b.add(q, ir.Constant(_L, 1))
        q.add_incoming(then, b.block)
        b.cbranch(b.icmp_signed("<", then, ir.Constant(_L, p.points)), loop, after)
        b.position_at_end(after)
        for n in phases[2]:
            if n.op == "given":
                known[n] = b.load(self._sum(_column(n)), align=64)
            self.emitter.all([n], known)
        self._write([x for x in p.puts if not self._has_points(x.array)], known, None)

    def _add(self, nodes: Sequence[Node], known: dict[Node, Any]) -> None:
        """What belongs to a point; each number of `sums` is added as soon as it is known, so that few wait in registers."""
        b, done = self.b, 0
        for k, n in enumerate(self.program.sums):
            if n not in known:
                last = nodes.index(n, done) + 1
                self._all(nodes[done:last], known)
                done = last
            b.store(b.fadd(b.load(self._sum(k), align=64), known[n]), self._sum(k), align=64)
        self._all(nodes[done:], known)

    def _all(self, nodes: Iterable[Node], known: dict[Node, Any]) -> None:
        self.emitter.all(nodes, known)

    def _sum(self, k: int) -> Any:
        return self.b.gep(self.room, [ir.Constant(_L, k)])

    def _has_points(self, array: str) -> bool:
        kind = self.program.arrays[array]
        return bool(kind.columns) if isinstance(kind, Shared) else kind.points

    def _phases(self) -> tuple[list[Node], list[Node], list[Node]]:
        """Nodes that points share, those of a point, those of their sums, each in the order in which they are wanted."""
        p = self.program
        nodes = demanded([*p.sums, *(x.node for x in p.puts)])
        own: dict[Node, int] = {}
        for n in nodes:
            if n.op == "given":
                assert isinstance(n.value, tuple)
                array = str(n.value[0])
                own[n] = 2 if array == "total" else int(self._has_points(array))
            else:
                of = {own[x] for x in _arguments(n)} | {0}
                if len(of) == 3 or (1 in of and 2 in of):
                    raise ValueError("what follows from sums over points cannot be mixed with what belongs to a point")
                own[n] = max(of)
        return tuple([n for n in nodes if own[n] == k] for k in range(3))  # type: ignore[return-value]

    def _place(self, array: str, row: Any, column: int, q: Any) -> Any:
        b, kind = self.b, self.program.arrays[array]
        size, type_ = (1, _B) if isinstance(kind, Marks) else (8, _D)
        at = b.add(self.base[array], ir.Constant(_L, size * column))
        if row is not None:
            at = b.add(at, b.mul(row, self.stride[array]))
        if q is not None and self._has_points(array):
            width = ir.Constant(_L, 1 if isinstance(kind, Marks) else size * kind.columns)
            at = b.add(at, b.mul(q, b.mul(width, self.directions) if _of_directions(kind) else width))
        return b.inttoptr(at, type_.as_pointer())

    def _read(self, nodes: Iterable[Node], known: dict[Node, Any], q: Any) -> None:
        b, wanted = self.b, dict[str, list[Node]]()
        for n in nodes:
            if n.op == "given" and n not in known:
                assert isinstance(n.value, tuple)
                wanted.setdefault(str(n.value[0]), []).append(n)
        for array, some in wanted.items():
            kind = self.program.arrays[array]
            column = {n: _column(n) for n in some}
            if isinstance(kind, Shared):
                for n in some:
                    known[n] = self.emitter.spread(b.load(self._place(array, None, column[n], q)))
            elif isinstance(kind, Marks):
                v = ir.Constant(_VB, ir.Undefined)
                for j, row in enumerate(self.rows):
                    byte = b.load(self._place(array, row, 0, q))
                    v = b.insert_element(v, b.icmp_unsigned("!=", byte, ir.Constant(_B, 0)), ir.Constant(_S, j))
                known[some[0]] = v
            else:
                for first, wide in _blocks(column.values(), kind.columns):
                    self.emitter.now_and_then()
                    found = self._columns([self._place(array, row, first, q) for row in self.rows], wide)
                    for n in some:
                        if first <= column[n] < first + wide:
                            known[n] = found[column[n] - first]

    def _columns(self, places: Sequence[Any], wide: int) -> list[Any]:
        """Vectors of so many numbers that follow one another from each of eight places on."""
        b = self.b
        if wide >= WIDE // 2:
            return list(transposed(b, [load(b, place, wide) for place in places]))
        out = []
        for k in range(wide):
            v = ir.Constant(_V, ir.Undefined)
            for j, place in enumerate(places):
                v = b.insert_element(v, b.load(b.gep(place, [ir.Constant(_L, k)])), ir.Constant(_S, j))
            out.append(v)
        return out

    def _write(self, some: Iterable[Put], known: Mapping[Node, Any], q: Any) -> None:
        b, by_array = self.b, dict[str, dict[int, Any]]()
        for x in some:
            by_array.setdefault(x.array, {})[x.column] = known[x.node]
        for array, values in by_array.items():
            kind = self.program.arrays[array]
            if isinstance(kind, Marks):
                for j, row in enumerate(self.rows):
                    bit = b.extract_element(values[0], ir.Constant(_S, j))
                    b.store(b.zext(bit, _B), self._place(array, row, 0, q))
                continue
            width = max(values) + 1
            if sorted(values) != list(range(width)):
                raise ValueError(f"of {array!r} the columns {sorted(values)} alone are computed")
            for first, wide in _blocks(values, width):
                self._put([values[first + k] for k in range(wide)], [self._place(array, row, first, q) for row in self.rows])

    def _put(self, values: Sequence[Any], places: Sequence[Any]) -> None:
        """Vectors → numbers that follow one another from each of eight places on; padded rows repeat the last one."""
        b, wide = self.b, len(values)
        self.emitter.now_and_then()
        if wide >= WIDE // 2:
            found = transposed(b, [*values, *[ir.Constant(_V, ir.Undefined)] * (WIDE - wide)])
            for v, place in zip(found, places):
                store(b, v, place, wide)
            return
        for k, v in enumerate(values):
            for j, place in enumerate(places):
                b.store(b.extract_element(v, ir.Constant(_S, j)), b.gep(place, [ir.Constant(_L, k)]))


class _WriterOfDirections(_Writer):
    """One kernel's instructions, of which some are gone through for each direction.

    Unrolled, those of five directions do not fit into the cache of instructions, and values they share are spilled as often.
    Numbers of arrays with directions lie transposed in memory of the kernel's own (``own``), as do values of directions that
    points share (``saved``).
    """

    def _rooms(self) -> None:
        b, m, arrays = self.b, self.directions, self.program.arrays
        self.emitter.directed = frozenset(name for name, kind in arrays.items() if _of_directions(kind))
        self.emitter.directions = m
        self.room = self._vectors(b.mul(m, ir.Constant(_L, len(self.program.sums))))
        self.own = {
            name: self._vectors(b.mul(m, ir.Constant(_L, kind.columns)))
            for name, kind in arrays.items() if isinstance(kind, Rows) and kind.directions
        }  # fmt: skip
        self.read = {str(n.value[0]) for n in self._nodes() if n.op == "given" and isinstance(n.value, tuple)}
        self.written = {x.array for x in self.program.puts}
        self.common, self.each = self._by_direction()
        at_end = [x.node for x in self.program.puts if not self._has_points(x.array)]
        pointwise = [x.node for x in self.program.puts if self._has_points(x.array)]
        later = self._from_before(self.each[1], [*self.program.sums, *pointwise]) + self._from_before(self.each[2], at_end)
        self.places = {n: k for k, n in enumerate(dict.fromkeys(n for n in later if n.op != "given"))}
        self.saved = self._vectors(b.mul(m, ir.Constant(_L, max(len(self.places), 1))))

    def _nodes(self) -> list[Node]:
        return demanded([*self.program.sums, *(x.node for x in self.program.puts)])

    def _by_direction(self) -> tuple[list[list[Node]], list[list[Node]]]:
        """Of each phase the nodes that directions share, and those that they have of their own."""
        own = set[Node]()
        for n in self._nodes():
            array = str(n.value[0]) if n.op in ("given", "cell") and isinstance(n.value, tuple) else ""
            if array == "total" or array in self.emitter.directed or any(x in own for x in _arguments(n)):
                own.add(n)
        phases = self._phases()
        return [[n for n in p if n not in own] for p in phases], [[n for n in p if n in own] for p in phases]

    def _from_before(self, nodes: Sequence[Node], outputs: Sequence[Node]) -> list[Node]:
        """What nodes and outputs of a phase need of what directions have of their own before; of products their factors too."""
        before = set(self.each[0]) - set(nodes)
        found = [x for n in nodes for x in _arguments(n) if x in before] + [x for x in outputs if x in before]
        return found + [y for x in found if x.op == "*" for y in x.args if y in before]

    def _group(self) -> None:
        b, p, known = self.b, self.program, dict[Node, Any]()
        self._read(self.common[0], known, None)
        self.emitter.all(self.common[0], known)
        self._transpose_in(None)
        self._loop(self.directions, 1, lambda j: self._before_points(j, known))
        sums = b.mul(self.directions, ir.Constant(_L, len(p.sums)))
        self._loop(sums, 1, lambda k: b.store(_both(0.0), b.gep(self.room, [k]), align=64))
        self._loop(ir.Constant(_L, p.points), 1, lambda q: self._point(q, known))
        self._loop(self.directions, 1, lambda j: self._after_points(j, known))
        self._transpose_out(None)

    def _before_points(self, j: Any, shared: Mapping[Node, Any]) -> None:
        known = self._begin(j, shared)
        self._all(self.each[0], known)
        for n in self.places:
            self.b.store(known[n], self._saved(n), align=64)

    def _point(self, q: Any, shared: Mapping[Node, Any]) -> None:
        known = dict(shared)
        self._read(self.common[1], known, q)
        self.emitter.all(self.common[1], known)
        self._transpose_in(q)
        self._loop(self.directions, 1, lambda j: self._at_point(j, known))
        self._transpose_out(q)

    def _at_point(self, j: Any, shared: Mapping[Node, Any]) -> None:
        known = self._begin(j, shared)
        self._add(self.each[1], known)
        self._keep(known, True)

    def _after_points(self, j: Any, shared: Mapping[Node, Any]) -> None:
        known = self._begin(j, shared)
        self._all(self.each[2], known)
        self._keep(known, False)

    def _begin(self, j: Any, shared: Mapping[Node, Any]) -> dict[Node, Any]:
        self.emitter.direction = j
        return dict(shared)

    def _all(self, nodes: Iterable[Node], known: dict[Node, Any]) -> None:
        """As `_Emitter.all`; what has been found before is fetched where it is first wanted."""
        for n in nodes:
            if n.op == "given":
                continue
            for x in _arguments(n):
                self._fetch(x, known)
                if n.op in ("+", "-") and x.op == "*":
                    for y in x.args:
                        self._fetch(y, known)
            self.emitter.all([n], known)

    def _fetch(self, n: Node, known: dict[Node, Any]) -> None:
        b = self.b
        if n in known:
            return
        if n.op != "given":
            known[n] = b.load(self._saved(n), align=64)
            return
        assert isinstance(n.value, tuple)
        array, column = str(n.value[0]), _column(n)
        if array == "total":
            known[n] = b.load(self._sum(column), align=64)
        elif array in self.own:
            known[n] = b.load(b.gep(self.own[array], [self.emitter.place_of(column)]), align=64)
        else:
            known[n] = self.emitter.spread(b.load(b.gep(self.emitter.tables[array][0], [self.emitter.place_of(column)])))

    def _keep(self, known: dict[Node, Any], pointwise: bool) -> None:
        """Numbers of the direction at hand that are written → the kernel's own memory."""
        for x in self.program.puts:
            if self._has_points(x.array) == pointwise:
                self._fetch(x.node, known)
                self.b.store(known[x.node], self.b.gep(self.own[x.array], [self.emitter.place_of(x.column)]), align=64)

    def _saved(self, n: Node) -> Any:
        return self.b.gep(self.saved, [self.emitter.place_of(self.places[n])])

    def _sum(self, k: int) -> Any:
        return self.b.gep(self.room, [self.emitter.place_of(k)])

    def _loop(self, count: Any, step: int, body: Callable[[Any], object]) -> None:
        """Instructions for k = 0, ``step``, … below a count, of which there is at least one."""
        b = self.b
        before, loop, after = b.block, b.append_basic_block("each"), b.append_basic_block("done")
        b.branch(loop)
        b.position_at_end(loop)
        k = b.phi(_L)
        k.add_incoming(ir.Constant(_L, 0), before)
        body(k)
        then = b.add(k, ir.Constant(_L, step))
        k.add_incoming(then, b.block)
        b.cbranch(b.icmp_signed("<", then, count), loop, after)
        b.position_at_end(after)

    def _transpose_in(self, q: Any) -> None:
        """Numbers of all directions → the kernel's own memory, those of point q or, without, of whole rows."""
        for array in self.own:
            if array in self.read and self._has_points(array) == (q is not None):
                self._transpose(array, q, self._in_together, self._in_one_by_one)

    def _transpose_out(self, q: Any) -> None:
        """The kernel's own memory → numbers of all directions."""
        for array in self.own:
            if array in self.written and self._has_points(array) == (q is not None):
                self._transpose(array, q, self._out_together, self._out_one_by_one)

    def _transpose(self, array: str, q: Any, together: Callable[..., object], one_by_one: Callable[..., object]) -> None:
        """Eight numbers of each row at a time; the last eight begin earlier instead of reaching beyond the row."""
        b, own, kind = self.b, self.own[array], self.program.arrays[array]
        assert isinstance(kind, Rows)
        places = [self._place(array, row, 0, q) for row in self.rows]
        count, wide = b.mul(self.directions, ir.Constant(_L, kind.columns)), ir.Constant(_L, WIDE)

        def some(k: Any) -> None:
            last = b.sub(count, wide)
            first = b.select(b.icmp_signed("<", k, last), k, last)
            together(b.gep(own, [first]), [b.gep(place, [first]) for place in places])

        with b.if_else(b.icmp_signed("<", count, wide)) as (few, many):
            with few:
                self._loop(count, 1, lambda k: one_by_one(b.gep(own, [k]), [b.gep(place, [k]) for place in places]))
            with many:
                self._loop(count, WIDE, some)

    def _in_together(self, own: Any, places: Sequence[Any]) -> None:
        for k, v in enumerate(self._columns(places, WIDE)):
            self.b.store(v, self.b.gep(own, [ir.Constant(_L, k)]), align=64)

    def _in_one_by_one(self, own: Any, places: Sequence[Any]) -> None:
        self.b.store(self._columns(places, 1)[0], own, align=64)

    def _out_together(self, own: Any, places: Sequence[Any]) -> None:
        self._put([self.b.load(self.b.gep(own, [ir.Constant(_L, k)]), align=64) for k in range(WIDE)], places)

    def _out_one_by_one(self, own: Any, places: Sequence[Any]) -> None:
        self._put([self.b.load(own, align=64)], places)


def instructions(program: Program, name: str) -> str:
    """LLVM's instructions of a program, as a function of a name: of the number of rows and of the arrays' headers."""
    writer = _WriterOfDirections if any(map(_of_directions, program.arrays.values())) else _Writer
    return str(writer(program, name).module)
