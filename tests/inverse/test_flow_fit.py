"""Flow laws through measured curves: exact data give back the constants, and what is not a flow curve is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.errors import PrensaError
from prensa.inverse.flow_data import read_flow
from prensa.inverse.flow_laws import FLOW_LAWS, extrapolated, fit_flow
from prensa.inverse.flow_report import figure_of, snippet
from prensa.materials.flow_curve import stress_at
from prensa.model.schema import loads, plain

STRAIN = np.concatenate([[0.0], np.geomspace(2e-3, 0.4, 30)])
K, E0, N = 565.0, 0.007, 0.26
EXACT = [
    pr.Swift(K=565.32, e0=0.007117, n=0.2589), pr.Swift(K=1275.0, e0=1.1e-4, n=0.45), pr.Swift(K=410.0, e0=0.0044, n=0.05),
    pr.Voce(s0=120.0, Q=180.0, b=12.0), pr.Voce(s0=60.0, Q=240.0, b=1.5), pr.Ludwik(s0=210.0, K=430.0, n=0.45),
    pr.HockettSherby(s0=150.0, s_inf=420.0, b=4.0, n=0.7), pr.HockettSherby(s0=90.0, s_inf=900.0, b=1.1, n=0.4),
    pr.SwiftVoce(K=K, e0=E0, n=N, s0=K * E0**N, Q=200.0, b=12.0, w=0.6),  # one yield stress of both parts
]  # fmt: skip


@pytest.mark.parametrize("curve", EXACT, ids=lambda c: f"{c.type} {c!r:.30}")
def test_exact_data_give_back_the_constants(curve):
    """To 1e-6, and the law that they are of is the best of all, or one that contains it with more constants is no better."""
    stress = stress_at(curve, STRAIN, np.zeros_like(STRAIN))
    best, *_ = fit_flow(STRAIN, stress)
    assert best.law == curve.type
    assert plain(best.curve) == {k: v if k == "type" else pytest.approx(v, rel=1e-6) for k, v in plain(curve).items()}


def test_constants_are_found_whatever_the_range_of_strains():
    """Of thin sheets that part at some per cent and of torsion tests to strains of three, of random constants."""
    rng = np.random.default_rng(0)
    for last in np.geomspace(0.03, 3.0, 8):
        strain = np.concatenate([[0.0], np.geomspace(last / 200, last, 30)])
        s0, n = rng.uniform(80, 600), rng.uniform(0.08, 0.6)
        for curve in (
            pr.Swift(K=3 * s0, e0=10 ** rng.uniform(-4, -1.5), n=n), pr.Voce(s0=s0, Q=s0, b=10 ** rng.uniform(0, 1.3) / last),
            pr.Ludwik(s0=s0, K=2 * s0, n=n + 0.1), pr.HockettSherby(s0=s0, s_inf=2.5 * s0, b=2 / last ** (n + 0.2), n=n + 0.2),
        ):  # fmt: skip
            (found,) = fit_flow(strain, stress_at(curve, strain, 0 * strain), [curve.type])
            assert plain(found.curve) == {k: v if k == "type" else pytest.approx(v, rel=1e-6) for k, v in plain(curve).items()}


@pytest.mark.parametrize("digits", [3, 4])
def test_rounded_readings_are_of_the_law_with_the_fewest_constants(digits):
    """A law that contains it follows their rounding more closely and is not preferred for that."""
    for curve in (EXACT[0], EXACT[3], EXACT[5]):
        exact = stress_at(curve, STRAIN, 0 * STRAIN)
        best, *others = fit_flow(STRAIN, np.array([float(f"{s:.{digits}g}") for s in exact]))
        assert best.law == curve.type
        assert any(f.error < 1.05 * best.error and not f.worse for f in others)
        beyond = stress_at(curve, np.full(1, 0.8), np.zeros(1))
        np.testing.assert_allclose(stress_at(best.curve, np.full(1, 0.8), np.zeros(1)), beyond, rtol=10.0 ** (1 - digits) / 5)


@pytest.mark.slow
def test_the_law_of_scattering_readings_is_found_and_more_constants_have_to_pay():
    """Scatter of 0.5 %: nine times of ten it is their law, or one with no more constants that fits them no worse."""
    rng, found = np.random.default_rng(3), 0
    for curve in (EXACT[0], EXACT[3], EXACT[5], EXACT[6]):
        exact = stress_at(curve, STRAIN, 0 * STRAIN)
        for _ in range(5):
            best, *others = fit_flow(STRAIN, exact * (1.0 + 0.005 * rng.standard_normal(len(STRAIN))))
            own = next(f for f in (best, *others) if f.law == curve.type)
            found += best.constants <= own.constants and best.error <= 1.05 * own.error
    assert found >= 18


@pytest.mark.slow
def test_the_band_covers_the_curve_as_often_as_it_says():
    """At twice the last strain, in 95 % of 200 draws, to three standard deviations of that number."""
    rng, truth, inside = np.random.default_rng(5), pr.Swift(K=600.0, e0=0.01, n=0.2), 0
    strain, far = np.linspace(0.0, 0.3, 40), np.full(1, 0.6)
    exact, there = (stress_at(truth, x, np.zeros_like(x)) for x in (strain, far))
    for _ in range(200):
        (fit,) = fit_flow(strain, exact + rng.normal(0.0, 2.0, len(strain)), ["swift"])
        inside += abs(stress_at(fit.curve, far, np.zeros(1)) - there)[0] <= fit.band(far)[0]
    assert abs(inside / 200 - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / 200)


def test_laws_without_yield_stress_are_no_error():
    """Readings from late on, which Ludwik's law would have begin at nothing: it is fitted with a negligible yield stress."""
    strain = np.linspace(0.02, 0.4, 25)
    stress = stress_at(pr.Swift(K=565.0, e0=1e-5, n=0.1), strain, 0 * strain)
    fits = fit_flow(strain, stress)
    assert fits[0].law == "swift" and {f.law for f in fits} == set(FLOW_LAWS)
    assert any(not f.determined for f in fits)


def test_the_error_of_readings_is_found_and_ranks_the_laws():
    """Readings of Swift's law with an error of 2 MPa: its own law is the best, and its error that of the readings."""
    rng = np.random.default_rng(7)
    truth = pr.Swift(K=600.0, e0=0.01, n=0.2)
    strain = np.linspace(0.0, 0.3, 200)
    stress = stress_at(truth, strain, np.zeros_like(strain)) + rng.normal(0.0, 2.0, len(strain))
    fits = fit_flow(strain, stress)
    errors = {f.law: f.error for f in fits}
    assert list(errors.values()) == sorted(errors.values()) and set(errors) == set(FLOW_LAWS)
    assert errors["swift"] == pytest.approx(2.0, rel=0.15)  # of 197 degrees of freedom, three times √(1/394)
    assert errors["voce"] > 1.2 * errors["swift"]
    swift = next(f for f in fits if f.law == "swift")
    np.testing.assert_allclose(swift.residuals, stress - stress_at(swift.curve, strain, 0 * strain))
    # at the least squares the residuals are normal to the change by K, which is the curve itself
    assert abs(swift.residuals @ stress_at(swift.curve, strain, 0 * strain)) < 1e-8 * (stress @ stress)


def test_laws_part_beyond_the_data():
    """A saturating law and a power law through the same readings: close at their end, apart at twice the strain."""
    stress = stress_at(EXACT[0], STRAIN, 0 * STRAIN)
    fits = fit_flow(STRAIN, stress, ["swift", "voce"])
    (_, ends, near), (_, there, far) = extrapolated(fits, (0.4, 0.8))
    assert near < 0.05 < 0.1 < far
    assert far == pytest.approx((there.max() - there.min()) / there.mean()) and ends[0] == pytest.approx(stress[-1])


def test_few_readings_leave_out_laws_of_many_constants():
    """Five readings bear laws of three and four constants."""
    strain = np.array([0.0, 0.05, 0.1, 0.2, 0.3])
    laws = {f.law for f in fit_flow(strain, stress_at(EXACT[0], strain, 0 * strain))}
    assert laws == {"swift", "voce", "ludwik", "hockett_sherby"}


def test_tables_are_read_as_testing_machines_write_them(tmp_path):
    """Semicolons, decimal commas, a row of units, per cent; stresses in MPa where a unit is stated, else plain."""
    path = tmp_path / "flow.csv"
    path.write_text("Umformgrad;Fließspannung\n%;GPa\n0;0,2\n5;0,3\n10;0,34\n20;0,36\n", encoding="utf-8")
    data = read_flow(path)
    np.testing.assert_allclose(data.strain, [0.0, 0.05, 0.1, 0.2])
    np.testing.assert_allclose(data.stress, [200.0, 300.0, 340.0, 360.0])
    assert data.unit == "MPa"
    path.write_text("0,200\n0.05,300\n0.1,340\n0.2,360\n", encoding="utf-8")
    assert read_flow(path).unit == ""


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0,200\n0.1,300\n0.2,350\n", r"flow.csv: 3 readings are too few; give 4 at least"),
        ("0,200\n0.1,300\n0.05,310\n0.2,350\n", r"flow.csv:3: plastic strain falls from 0.1 to 0.05; give rising strains"),
        ("0,0\n0.1,300\n0.2,350\n0.3,360\n", r"flow.csv:1: flow stress 0; flow curves begin at the yield stress"),
        ("-0.1,200\n0.1,300\n0.2,350\n0.3,360\n", r"flow.csv:1: plastic strain -0.1; give sizes"),
        ("0,200\n10,300\n20,350\n30,360\n", r"flow.csv: plastic strains to 30 look like per cent"),
        ("0,200\n0.1,350\n0.2,340\n0.3,325\n0.4,305\n0.5,280\n", r"flow.csv:2: the stress falls from 350 here to 280"),
        ("0.0005,100\n0.001,200\n0.1,300\n0.2,320\n", r"flow.csv:1: the stress rises in proportion to the strain"),
        ("eng. strain,stress (MPa)\n0,200\n0.1,300\n0.2,350\n0.3,360\n", r"'eng. strain' is of an engineering curve; give true"),
        ("strain,stress (kN)\n0,200\n0.1,300\n0.2,350\n0.3,360\n", r"'kN' states no unit of stress"),
        ("0,1,2\n1,2,3\n", r"two columns of finite numbers"),
    ],
)
def test_tables_of_something_else_are_refused_with_line_and_remedy(tmp_path, rows, words):
    """In one line each, on the command line with the exit code of bad input."""
    path = tmp_path / "flow.csv"
    path.write_text(rows, encoding="utf-8")
    with pytest.raises(PrensaError, match=words) as refused:
        read_flow(path)
    assert "\n" not in str(refused.value)
    assert CliRunner().invoke(app, ["fit", str(path)]).exit_code == 2 and not (tmp_path / "flow-fit.png").exists()


def test_scatter_at_the_end_is_no_necking(tmp_path):
    """Readings that scatter by more than the last ones fall are a flow curve."""
    path, strain = tmp_path / "flow.csv", np.linspace(0.0, 0.5, 60)
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(0.0, 3.0, 60)
        rows = zip(strain, stress_at(EXACT[3], strain, 0 * strain) + noise)  # saturates at 300
        path.write_text("\n".join(f"{e},{s}" for e, s in rows), encoding="utf-8")
        assert len(read_flow(path).strain) == 60


def test_the_command_ranks_draws_and_writes_what_can_be_pasted(tmp_path):
    """The last line is a flow curve of a case; the picture has readings, laws, what lies beyond, and residuals."""
    path = tmp_path / "flow.csv"
    rows = zip(STRAIN, stress_at(EXACT[0], STRAIN, 0 * STRAIN))
    path.write_text("strain;stress (MPa)\n" + "\n".join(f"{e:.17g};{s:.17g}" for e, s in rows), encoding="utf-8")
    done = CliRunner().invoke(app, ["fit", str(path), "--to", "1"])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "flow-fit.png").stat().st_size > 10_000
    line = next(text for text in done.output.splitlines() if text.startswith("flow: "))
    body = f"{{mesh: {{type: rectangle, size: [1, 1], n: [1, 1]}}, material: {{type: j2, E: 206 GPa, nu: 0.3, {line}}}}}"
    pasted = loads(f"name: n\nbodies: {{b: {body}}}\nsteps: [{{name: s}}]\n").problem.bodies["b"].material.flow
    assert pasted == pr.Swift(K=565.32, e0=0.007117, n=0.2589)
    assert "at 1" in done.output and "beyond the data nothing is known" in done.output
    given = json.loads(CliRunner().invoke(app, ["fit", str(path), "--json", "--law", "voce"]).stdout)
    assert [law["type"] for law in given["laws"]] == ["voce"] and given["beyond"][1]["strain"] == 0.8
    data = read_flow(path)
    fits = fit_flow(data.strain, data.stress)
    top, low = figure_of(data, fits).axes
    assert top.get_xlim()[1] == pytest.approx(0.8) and len(low.lines) >= len(fits)
    assert snippet(fits[0], "").startswith("flow: {type: swift, K: 565.32, e0: ")
    assert CliRunner().invoke(app, ["fit", str(path), "--law", "swfit"]).exit_code == 2
