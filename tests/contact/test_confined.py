"""Confined layers, nearly incompressible ones among them: the default penalty against exact enforcement on the same mesh."""

import numpy as np
import pytest

import prensa as pr

ALLOWED = 0.01
"""Error of a force that nobody is warned of."""


def layer(nu, aspect, elements, mu, space, enforcement):
    """Half of a layer of thickness 2 and half width ``aspect`` between rough plates, pressed by 1 %."""
    fixed = {"pad.bottom": "y"} if space == "axisymmetric" else {"pad.bottom": "y", "pad.left": "x"}
    mesh = pr.Rectangle((aspect, 1.0), n=(min(60, max(4, round(aspect * elements))), elements))
    return pr.Problem(
        "layer", space=space, bodies={"pad": pr.Body(mesh, pr.NeoHooke(3.0, nu))},
        tools={"plate": pr.Plane(touching="pad.top")},
        contacts=[pr.Contact(("pad.top", "pad.right"), "plate", pr.Coulomb(mu), enforcement)],
        fixed=fixed,
        steps=[pr.Step("press", move={"plate": {"y": -0.01}}, increments=2)],
    )  # fmt: skip


def force(problem):
    """Force on the plate at the end."""
    *_, increment = pr.solve(problem)
    return increment.force("plate").y


@pytest.mark.parametrize("seed", range(12))
def test_the_default_penalty_is_exact_to_one_per_cent_or_reports_its_share(seed, caplog):
    """Of random Poisson's ratios, aspects, meshes and friction; the share that is reported is the error to a third of it."""
    rng = np.random.default_rng(seed)
    nu = 0.5 - 0.2 * float(np.exp(rng.uniform(np.log(5e-4), 0.0)))
    aspect, elements = float(np.exp(rng.uniform(0.0, np.log(50.0)))), int(rng.integers(1, 6))
    mu, space = float(rng.choice([0.0, 0.3, 2.0])), str(rng.choice(["plane strain", "axisymmetric"]))
    draw = (nu, aspect, elements, mu, space)
    reference = force(layer(*draw, pr.Exact()))
    caplog.clear()
    error = force(layer(*draw, pr.Penalty())) / reference - 1.0
    said = [words for words in caplog.messages if "store" in words]
    assert abs(error) <= ALLOWED or said, (draw, error)
    for words in said:
        share = float(words.partition(" store ")[2].partition(" %")[0]) / 100.0
        assert share == pytest.approx(-error, rel=1 / 3), (draw, error)


def test_soft_springs_are_reported_with_the_share_by_which_forces_are_low(caplog):
    """A spring as stiff as a layer under it takes half of the way: the force is half as large, to second order a third lower."""
    draw = (0.3, 50.0, 1, 0.0, "plane strain")
    whole, soft = force(layer(*draw, pr.Exact())), force(layer(*draw, pr.Penalty(10.0)))
    # two springs in series, the layer with β = 1: 1/(1 + 1/β)
    confined = 3.0 / (1 - 0.3**2) * 1.3 * 0.4 / (3.0 * 0.7)
    assert soft / whole == pytest.approx(1.0 / (1.0 + confined / 10.0), rel=2e-3)
    assert any("store" in words and "beta" in words for words in caplog.messages)
