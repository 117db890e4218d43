"""Area on which friction acts: a share of the normal force whatever the area, a traction per current area, or one by branch."""

from __future__ import annotations

from dataclasses import replace

import pytest

import prensa as pr
from prensa.verify.forming import upsetting
from problems import stroke, upset_block


def force(friction):
    """Tool force at 20 % of upsetting in ten increments, at which the surface grows by a percent in each."""
    p = upsetting((8, 6), 0.1, reductions=(0.1, 0.2))
    contacts = tuple(replace(c, friction=friction) for c in p.contacts)
    steps = tuple(replace(s, increments=5) for s in p.steps)
    *_, last = pr.solve(replace(p, contacts=contacts, steps=steps, friction=None))
    return last.force("punch").y


@pytest.mark.parametrize(
    ("pure", "capped"),
    [
        (pr.Coulomb(0.1), pr.Capped(0.1, m=1.0, k=1e6)),
        (pr.Coulomb(0.3), pr.Capped(0.3, m=1.0, k=1e6)),
        (pr.Shear(0.3), pr.Capped(50.0, m=0.3)),
    ],
    ids=["small mu", "large mu", "shear"],
)
def test_a_law_of_two_branches_is_each_of_them_in_its_limit(pure, capped):
    """min(μ p, m k) gives the forces of Coulomb's law and of the shear factor to 1e-9, whichever branch governs."""
    assert force(capped) == pytest.approx(force(pure), rel=1e-9)


def test_between_the_limits_the_force_is_below_both():
    """Where one branch governs here and the other there, friction is less than either law's everywhere."""
    both, coulomb, shear = (force(law) for law in (pr.Capped(0.1, m=0.2), pr.Coulomb(0.1), pr.Shear(0.2)))
    assert force(None) < both < min(coulomb, shear)


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=["penalty", "augmented", "exact"])
def test_the_energy_balance_has_the_work_of_friction_on_areas_that_change(enforcement):
    """A strip drawn out to 1.75 of its length under a plate: what the energy balance misses falls with the square of
    the increment.
    """

    def missed(increments):
        problem = upset_block(
            stroke(-0.1), pr.Step("draw", increments=increments, by={"b.right": {"x": 3.0}}),
            tools={"t": pr.Plane(at=(2.0, 1.0), normal=(0.0, -1.0))}, material=pr.NeoHooke(10.0, 0.3),
            size=(4.0, 1.0), n=(8, 2), element="q4", friction=pr.Coulomb(0.2), enforcement=enforcement,
        )  # fmt: skip
        *_, last = pr.solve(problem)
        return last.energy["imbalance"] / last.energy["friction"]

    coarse, fine = missed(10), missed(40)
    assert abs(fine) < min(abs(coarse) / 8, 4e-3)
