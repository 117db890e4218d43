"""Cross-references are checked in Python too, and what is only likely a slip is a warning."""

from __future__ import annotations

import pytest

import prensa as pr
from prensa.errors import CaseError
from prensa.mesh.generate import mesh_of
from prensa.model.checks import _boundaries
from prensa.model.schema import loads, warnings_of

from .test_mistakes import CASE


def test_python_reports_all_cross_references_at_once():
    """The error of the constructor names every path that is wrong, not only the first."""
    body = pr.Body(pr.Rectangle((1, 1), (2, 2)), pr.Elastic(E=1, nu=0))
    with pytest.raises(CaseError) as caught:
        pr.Problem("p", {"b": body}, [pr.Step("s", move={"t": {"y": 1}})], contacts=[pr.Contact("b.topp", "u")])
    for path in (
        "steps.0.move.t: unknown tool",
        "contacts.0.surface.0: unknown boundary",
        "contacts.0.against: unknown",
    ):
        assert path in str(caught.value)


def test_the_boundaries_known_before_meshing_are_those_of_the_mesh():
    """A file can be checked without meshing because the names are the mesh generator's."""
    body = pr.Body(pr.Rectangle((1, 1), (2, 2)), pr.Elastic(E=1, nu=0))
    mesh = mesh_of(body.mesh)
    assert sorted(_boundaries(body)) == sorted([*mesh.edges, *mesh.corners])


def test_a_friction_table_is_read_beside_the_case_file(tmp_path):
    """A CSV of slip and mu, with or without a head line, is the table it holds; its mistakes are the case's."""
    case = tmp_path / "case.yaml"
    case.write_text(CASE.replace("mu: 0.3", "mu: mu.csv"))
    for text in ("slip,mu\n0,0.1\n1.5,0.2\n", "# measured\n0; 0.1\n\n1.5; 0.2\n"):
        (tmp_path / "mu.csv").write_text(text)
        mu = pr.load(case).problem.contacts[0].friction.mu
        assert mu == pr.MuTable(kappa=(0.0, 1.5), mu=(0.1, 0.2))
    for text, words in (
        ("0,0.1\n1\n", "two columns"),
        ("1,0.1\n2,0.2\n", "start at 0"),
        ("0,0.1\n1,nan\n", "finite"),
        ("0,0.1\n1,-1\n", "at least 0"),
        ("", "two columns"),
        ("\xff", "two columns"),
    ):
        (tmp_path / "mu.csv").write_text(text)
        with pytest.raises(pr.CaseError, match=rf"case\.yaml:14:\d+: .*{words}"):
            pr.load(case)
    (tmp_path / "mu.csv").unlink()
    with pytest.raises(pr.CaseError, match="there is no such file"):
        pr.load(case)


SLIPS = [
    ("70 GPa", "70", ["E = 70 in N/mm²", "flow stress 60", "70e3", "'70 GPa'"]),
    ("s0: 60", "s0: 60e6", ["flow stress 6e+07", "check the units"]),
    ("{type: voce, s0: 60, Q: 120, b: 8}", "{type: swift, K: 200, e0: 0.1, n: 1.5}", ["an exponent of 1.5", "below 1"]),
    ("{type: voce, s0: 60, Q: 120, b: 8}", "{type: johnson_cook, A: 60, B: 90, n: 0.3, C: 0.02, rate0: 1}",
     ["rate of strain", "give 'duration'"]),
    ("mu: 0.3", "mu: 30", ["contacts.0.friction: mu = 30", "did you mean 0.3?"]),
    ("contacts:", "  die: {type: circle, radius: 1, at: [0, 0]}\ncontacts:", ["tools.die: no contact"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), SLIPS, ids=[s[1][:20] for s in SLIPS])
def test_a_likely_slip_is_a_warning(old, new, words):
    """What is allowed but unusual loads, and one sentence says what may have been meant."""
    assert warnings_of(loads(CASE).problem) == []
    said = warnings_of(loads(CASE.replace(old, new)).problem)
    assert len(said) == 1
    for word in words:
        assert word in said[0]


def test_exact_enforcement_refuses_rules_with_more_points_than_nodes():
    """The message stands at the rule and gives the reason; the nodal rule and one point an edge are accepted."""
    for rule in ("gauss2", "gauss3", "simpson", "kikuchi"):
        text = CASE.replace("against: punch,", f"against: punch, enforcement: {{type: exact}}, integration: {rule},")
        with pytest.raises(pr.CaseError, match=rf"^u\.yaml:14:\d+: '{rule}' has more points.*not unique.*'nodal'"):
            loads(text, "u.yaml")
        for accepted in (text.replace(rule, "gauss1"), text.replace(rule, "nodal"), text.replace("exact", "augmented")):
            loads(accepted)


def test_a_shear_factor_needs_a_shear_yield_stress():
    """A factor m on an elastic body is refused where it is written: in the contact, for all, in a step; k mends it."""
    elastic = CASE.replace(
        "type: j2, E: 70 GPa, nu: 0.33, flow: {type: voce, s0: 60, Q: 120, b: 8}", "type: elastic, E: 1, nu: 0"
    )
    law = "{type: shear, m: 0.5}"
    for text, place in (
        (elastic.replace("{type: coulomb, mu: 0.3}", law), "14:59"),
        (elastic.replace(", friction: {type: coulomb, mu: 0.3}", "") + f"friction: {law}\n", "20:1"),
        (elastic + f"    friction: {{billet.top+billet.right-punch: {law}}}\n", "20:16"),
    ):
        with pytest.raises(pr.CaseError, match=rf"^u\.yaml:{place}: the elastic body of 'billet.top'.*give 'k'"):
            loads(text, "u.yaml")
        loads(text.replace("m: 0.5", "m: 0.5, k: 3"))
        loads(CASE.replace("{type: coulomb, mu: 0.3}", law))


@pytest.mark.parametrize(
    ("space", "side", "thickness", "words"),
    [("axisymmetric", "left", 1.0, "lies off the axis.*leave that side out"), ("plane strain", "top", 5e-324, "unit of length")],
)
def test_a_contact_without_an_area_is_refused(space, side, thickness, words):
    """A side on the axis of revolution, or a thickness as small as numbers are, leaves no point that could press."""
    problem = pr.Problem(
        "flat", space=space, thickness=thickness, bodies={"b": pr.Body(pr.Rectangle((4, 3), (20, 2)), pr.Elastic(1000, 0.3))},
        tools={"p": pr.Plane(touching="b.top")}, contacts=[pr.Contact(f"b.{side}", "p")], fixed={"b.bottom": "xy"},
        steps=[pr.Step("press", move={"p": pr.Motion(y=-0.01)})],
    )  # fmt: skip
    with pytest.raises(pr.PrensaError, match=f"contact 'b.{side}-p': no point of its surface .*{words}"):
        pr.discretise(problem)
