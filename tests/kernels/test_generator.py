"""The generator of kernels: derivatives against the complex step of the same functions, bits, failures, the cache."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from prensa.kernels import functions, machine_code, record
from prensa.kernels.compiling import LINE, announced
from prensa.kernels.differentiate import forward, reverse, units
from prensa.kernels.emit import Marks, Program, Rows, Shared, puts, total
from prensa.kernels.machine_code import Kernel
from prensa.kernels.record import cell, either, exp, given, local, log, many, piece, root, sqrt, where

N = 37


def cubic(x: Any, a: Any, b: Any) -> Any:
    return b - a * x - x * x * x


def everything(x: Sequence[Any]) -> list[Any]:
    """A function of three numbers > 0 with every operation in it."""
    a, b, c = x
    far = either(a > 1.0, lambda s: s * s / 2.0 + s, lambda s: log(s) * 3.0, a)
    solved = root(cubic, b > 0.6, 0.1 + 0.0 * b, 0.0 * b, 9.0 + 0.0 * b, 1.0 + b, 1.0 + a, b)
    below = b < 0.8
    safe = where(below, exp(-b), sqrt(where(below, 1.0, b - 0.8) + 1.0))
    inner = local([far * c - solved / c, solved * solved + far], (far, solved, c))
    return [inner[0] + safe, inner[1] * sqrt(c), far / (1.0 + solved * solved) - functions.expm1(0.1 * a - 0.05)]


def slopes_by_complex_step(f: Callable[[Sequence[Any]], list[Any]], x: np.ndarray) -> np.ndarray:
    """(n, outputs, inputs)."""
    out = []
    for k in range(x.shape[1]):
        z = x + 0j
        z[:, k] += 1e-30j
        out.append(np.stack([np.imag(v) / 1e-30 + np.zeros(len(x)) for v in f(list(z.T))], axis=-1))
    return np.stack(out, axis=-1)


def points(seed: int = 0) -> np.ndarray:
    return 0.2 + 1.6 * np.random.default_rng(seed).random((N, 3))


def answered(program: Program, *arrays: np.ndarray) -> None:
    Kernel(program)(len(arrays[0]), *arrays)


def test_values_and_derivatives_are_those_of_the_function() -> None:
    """Forwards, forwards through Jacobians of parts, and backwards, to round-off."""
    x, exact = points(), slopes_by_complex_step(everything, points())
    for mode in ("local", "forward", "reverse"):
        record.fresh()
        a = many("x", 3)
        f = everything(a)
        if mode == "reverse":
            J = [d for k in range(3) for d in reverse(f, [record.lift(float(k == i)) for i in range(3)], a)]
        else:
            J = [d for row in forward(f, units(a), 3, locals_=mode == "local") for d in row]
        value, slopes = np.empty((N, 3)), np.empty((N, 3, 3))
        answered(Program({"x": Rows(3), "f": Rows(3), "J": Rows(9)}, [*puts("f", f), *puts("J", J)]), x, value, slopes)
        plain = np.stack([v + np.zeros(N) for v in everything(list(x.T))], axis=-1)
        assert np.abs(value - plain).max() <= 4e-15 * np.abs(plain).max(), mode
        assert np.abs(slopes - exact).max() <= 1e-14 * np.abs(exact).max(), mode


def negative(x: Sequence[Any]) -> list[Any]:
    """Negative arguments of functions that are differentiated by them, at ordinary and at seldom points."""
    a, b, _ = x
    near = either(a > 1.0, lambda s: s * s * s + s, lambda s: exp(s), -a)
    rising = root(lambda r, p, q: p - q * r - r * r * r, b > 0.1, 0.0 * b, -9.0 + 0.0 * b, 9.0 + 0.0 * b, 1.0 + b, -a, b)
    return [near, rising]


def test_what_is_negative_is_differentiated_too() -> None:
    """Products of negative numbers are recorded without their signs; derivatives by the numbers are those of the function."""
    x, exact = points(), slopes_by_complex_step(negative, points())
    recorded = many("x", 3)
    values = negative(recorded)
    slopes = [s for row in forward(values, units(recorded), 3) for s in row]
    out = np.empty((N, 6))
    answered(Program({"x": Rows(3), "out": Rows(6)}, puts("out", slopes)), x, out)
    np.testing.assert_allclose(out.reshape(N, 2, 3), exact[:, :2], rtol=1e-12, atol=1e-14)


def test_a_local_value_that_hides_something_is_refused() -> None:
    """What is sought must not reach it by other ways than it names."""
    record.fresh()
    a, b = many("x", 2)
    (hidden,) = local([a * b], [a])
    with pytest.raises(ValueError, match="more of what is sought"):
        forward([hidden], units([a, b]), 2)


def test_a_row_has_the_same_bits_wherever_it_stands_and_whatever_else_is_computed() -> None:
    """Alone, among others, at the end of eight, and with or without derivatives."""
    x = points()
    found = []
    for derivatives in (False, True):
        record.fresh()
        a = many("x", 3)
        f = everything(a)
        J = [d for row in forward(f, units(a), 3) for d in row] if derivatives else []
        kernel = Kernel(Program({"x": Rows(3), "f": Rows(3), "J": Rows(9)}, [*puts("f", f), *puts("J", J)]))
        value, slopes = np.empty((N, 3)), np.empty((N, 9))
        kernel(N, x, value, slopes)
        found.append(value)
        for i in range(N):
            alone = np.empty((1, 3))
            kernel(1, x[i : i + 1], alone, np.empty((1, 9)))
            assert alone.tobytes() == value[i].tobytes()
    assert found[0].tobytes() == found[1].tobytes()


def test_sums_over_points_and_what_follows_from_them() -> None:
    """Numbers of rows, of points of rows and of all go together; flags are read and written."""
    rng, record_ = np.random.default_rng(1), record
    record_.fresh()
    scale, factor, x, on = given("scale", 0), given("factor", 0), given("x", 0), given("on", 0)
    term = scale * factor * x
    program = Program(
        {"scale": Rows(1), "factor": Shared(1), "x": Rows(1, points=True), "on": Marks(), "each": Rows(1, points=True),
         "sum": Rows(2), "large": Marks()},
        [*puts("each", [term]), *puts("sum", [total(0), where(on, total(0) * scale, 0.0)]), *puts("large", [total(0) > 1.0])],
        [term], 3,
    )  # fmt: skip
    s, w, v, flag = rng.random((N, 1)), rng.random(3), rng.random((N, 3)), rng.random(N) < 0.5
    each, sums, large = np.empty((N, 3)), np.empty((N, 2)), np.empty(N, dtype=np.bool_)
    Kernel(program)(N, s, w, v, flag, each, sums, large)
    assert np.allclose(each, s * w * v, rtol=1e-15)
    assert np.allclose(sums[:, 0], (s * w * v).sum(axis=1), rtol=1e-14)
    assert np.allclose(sums[:, 1], np.where(flag, sums[:, 0] * s[:, 0], 0.0), rtol=1e-15)
    assert np.array_equal(large, sums[:, 0] > 1.0)


@pytest.mark.parametrize("m", [1, 2, 3, 8, 11])
def test_directions_are_gone_through_one_after_the_other(m: int) -> None:
    """What follows from an array of directions is that of each of them, to the bit, however many there are.

    Numbers of rows, of points of rows and of all; rows of fewer than eight numbers and of more; products that are added to what
    points share and what they have of their own; sums and what follows from these; numbers that differ from piece to piece.
    """
    rng = np.random.default_rng(m)
    record.fresh()
    a, q, da, dq, dp = given("a", 0), given("q", 0), many("da", 2), given("dq", 0), given("dp", 0)
    product = a * da[0]
    slope = product - da[1] + q * dq + dp * cell(piece(q, "knots"), "dcells", 2, 1) + sqrt(q) * product
    arrays = {
        "a": Rows(1), "q": Rows(1, points=True), "knots": Shared(), "da": Rows(2, directions=True),
        "dq": Rows(1, points=True, directions=True), "dp": Shared(directions=True), "dcells": Shared(directions=True),
        "each": Rows(2, points=True, directions=True), "sum": Rows(2, directions=True),
    }  # fmt: skip
    written = [*puts("each", [slope, dq]), *puts("sum", [total(0), total(0) * da[1] + product])]
    kernel = Kernel(Program(arrays, written, [slope], 3))
    x, points_, knots = rng.random((N, 1)), 0.1 + rng.random((N, 3)), np.array([0.0, 0.5, 0.8, 1.2])
    dx, dpoints, numbers, cells = (rng.random((*of, m)) for of in ((N, 2), (N, 3, 1), (1,), (3, 2)))
    each, sums = np.empty((N, 3, 2, m)), np.empty((N, 2, m))
    kernel(N, x, points_, knots, dx, dpoints, numbers, cells, each, sums)
    at = np.clip(np.searchsorted(knots, points_, side="right") - 1, 0, 2)
    p = x[:, :, None] * dx[:, :1]
    by = p - dx[:, 1:] + points_[:, :, None] * dpoints[:, :, 0] + numbers[0] * cells[at, 1] + np.sqrt(points_)[:, :, None] * p
    assert np.allclose(each[:, :, 0], by, rtol=1e-13, atol=1e-15)
    assert np.array_equal(each[:, :, 1], dpoints[:, :, 0])
    assert np.allclose(sums[:, 0], by.sum(axis=1), rtol=1e-13, atol=1e-15)
    assert np.allclose(sums[:, 1], by.sum(axis=1) * dx[:, 1] + p[:, 0], rtol=1e-13, atol=1e-15)
    for j in range(m):
        one = [np.ascontiguousarray(d[..., j : j + 1]) for d in (dx, dpoints, numbers, cells)]
        own, whole = np.empty((N, 3, 2, 1)), np.empty((N, 2, 1))
        kernel(N, x, points_, knots, *one, own, whole)
        assert own[..., 0].tobytes() == each[..., j].tobytes()
        assert whole[..., 0].tobytes() == sums[..., j].tobytes()


def test_tables_are_looked_up() -> None:
    """Pieces between any number of knots, the first and the last one beyond them."""
    rng = np.random.default_rng(2)
    record.fresh()
    k = piece(given("x", 0), "knots")
    arrays = {"x": Rows(1), "knots": Shared(), "rows": Shared(), "out": Rows(2)}
    program = Program(arrays, puts("out", [cell(k, "rows", 3, 0), cell(k, "rows", 3, 2)]))
    for count in (2, 3, 7):
        knots, rows = np.sort(rng.random(count)), rng.random((count - 1, 3))
        x = np.append(knots, rng.uniform(-0.5, 1.5, N))[:, None]
        out = np.empty((len(x), 2))
        Kernel(program)(len(x), x, knots, rows, out)
        at = np.clip(np.searchsorted(knots, x[:, 0], side="right") - 1, 0, count - 2)
        assert np.array_equal(out, rows[at][:, [0, 2]])


def test_roots_that_are_not_there_fail_and_points_that_do_not_look_are_zero() -> None:
    """NaN of those alone; the derivative of a point that does not look for one is 0."""
    record.fresh()
    a, on = given("x", 0), given("x", 1)
    zero = record.ZERO * a
    x = root(lambda x, a: a - x + 1e-9 * log(2.2 - a), on > 0.5, zero + 1.0, zero, zero + 2.1, a, a)
    program = Program({"x": Rows(2), "out": Rows(2)}, puts("out", [x, forward([x], {a: [record.ONE]}, 1)[0][0]]))
    out = np.empty((3, 2))
    Kernel(program)(3, np.array([[2.0, 1.0], [2.0, 0.0], [2.5, 1.0]]), out)
    assert out[0, 0] == pytest.approx(2.0 + 1e-9 * np.log(0.2), rel=1e-15)
    assert out[1].tolist() == [0.0, 0.0]
    assert np.isnan(out[2, 0])  # no number
    Kernel(program)(1, np.array([[2.15, 1.0]]), out)
    assert np.isnan(out[0, 0])  # beyond where it is looked for


def test_logarithms_and_exponentials_are_right_to_the_last_digits() -> None:
    """Of numbers of any size; no numbers of what has no logarithm."""
    record.fresh()
    a, b = many("x", 2)
    program = Program({"x": Rows(2), "out": Rows(2)}, puts("out", [log(a), exp(b)]))
    rng = np.random.default_rng(3)
    x = np.stack([10 ** rng.uniform(-300, 300, 4000), rng.uniform(-700, 700, 4000)], axis=1)
    out = np.empty_like(x)
    Kernel(program)(len(x), x, out)
    assert np.abs(out[:, 0] / np.log(x[:, 0]) - 1.0).max() <= 4.5e-16
    assert np.abs(out[:, 1] / np.exp(x[:, 1]) - 1.0).max() <= 6e-16
    x = np.array([[-1.0, -1e4], [0.0, 1e4], [np.nan, np.nan], [np.inf, 0.0]])
    out = np.empty_like(x)
    Kernel(program)(len(x), x, out)
    assert np.isnan(out[:, 0]).all()
    assert out[[0, 1, 3], 1].tolist() == [0.0, np.inf, 1.0] and np.isnan(out[2, 1])


RUN = """
import sys
from pathlib import Path
import prensa as pr
from prensa.kernels import machine_code
from prensa.model.schema import load
machine_code.folder = lambda: Path(sys.argv[1])  # Numba's own kernels are not in question: they stay where they are
problem = load("examples/ring_compression.yaml").problem
for inc in pr.solve(problem):
    if inc.time > 0.05:
        break
print(machine_code.compiled)
"""


def test_the_next_process_compiles_nothing(tmp_path: Path) -> None:
    """Kernels of a run are found on the disk by the next one."""

    def run() -> int:
        done = subprocess.run([sys.executable, "-c", RUN, str(tmp_path)], capture_output=True, text=True, check=True)
        return int(done.stdout.split()[-1])

    assert run() > 0
    assert run() == 0


def test_code_that_is_not_whole_is_made_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A file that was cut is replaced by a whole one; what is whole is read."""
    monkeypatch.setattr(machine_code, "folder", lambda: tmp_path)
    counts = []
    for cut in (False, False, True, False):
        record.fresh()
        for path in tmp_path.iterdir() if cut else ():
            path.write_bytes(path.read_bytes()[:-8])
        before, out = machine_code.compiled, np.empty((1, 1))
        Kernel(Program({"x": Rows(1), "y": Rows(1)}, puts("y", [given("x", 0) * 54321.0])))(1, np.ones((1, 1)), out)
        counts.append(machine_code.compiled - before)
        assert out[0, 0] == 54321.0
    assert counts == [1, 0, 1, 0]


def test_kernels_are_kept_beside_those_of_numba(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where the user has put these."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert machine_code.folder.__wrapped__() == tmp_path / "prensa_kernels"  # type: ignore[attr-defined]


def test_a_kernel_that_is_compiled_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """One line, and none when it is found."""
    monkeypatch.setattr(machine_code, "folder", lambda: tmp_path)
    said: list[str] = []
    for _ in range(2):
        record.fresh()
        with announced(said.append):
            Kernel(Program({"x": Rows(1), "y": Rows(1)}, puts("y", [given("x", 0) * 12345.0])))
    assert said == [LINE]


def test_threads_may_want_kernels_at_the_same_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Each is recorded by one thread alone, and once."""
    monkeypatch.setattr(machine_code, "folder", lambda: tmp_path)
    made: list[float] = []

    @machine_code.generated
    def scaled(by: float) -> Program:
        made.append(by)
        f = everything(many("x", 3))
        return Program({"x": Rows(3), "f": Rows(3)}, puts("f", [by * v for v in f]))

    x, exact = points(), np.stack([v + np.zeros(N) for v in everything(list(points().T))], axis=-1)

    def answer(by: float) -> np.ndarray:
        out = np.empty((N, 3))
        scaled(by)(N, x, out)
        return out

    with ThreadPoolExecutor(4) as pool:
        factors = [1.5, 2.5, 3.5, 1.5, 2.5, 3.5, 1.5, 2.5]
        for by, found in zip(factors, pool.map(answer, factors)):
            assert np.abs(found - by * exact).max() <= 1e-14 * by * np.abs(exact).max()
    assert sorted(made) == [1.5, 2.5, 3.5]
