"""Tools whose edges or fillets are finer than the elements dip into a surface between its nodes: seen by geometry."""

import numpy as np
import pytest

import prensa as pr


def wedge(fillet, place, depth, length):
    """A blunt wedge with a small fillet at its tip, pressed into a block of elements of a ``length`` at x = ``place``."""
    points = ((0.0, 0.0), (4.0, 2.0), (4.0, 9.0), (-4.0, 9.0), (-4.0, 2.0))
    mesh = pr.Rectangle((12.0, 4.0), n=(round(12 / length), round(4 / length)))
    return pr.Problem(
        "wedge", bodies={"block": pr.Body(mesh, pr.Elastic(1000.0, 0.3))},
        tools={"tip": pr.Polygon(points=points, fillet=fillet, at=(place, 4.0))},
        fixed={"block.bottom": "xy"}, steps=[pr.Step("press", move={"tip": {"y": -depth}}, increments=4)],
    )  # fmt: skip


def said(problem, caplog):
    """What is reported of a run about edges between nodes; its failure too."""
    caplog.clear()
    try:
        list(pr.solve(problem))
    except pr.SolveError as error:
        return [str(error)]
    return [words for words in caplog.messages if "between nodes" in words]


@pytest.mark.parametrize("seed", range(10))
def test_a_tip_between_nodes_is_reported_where_it_is_a_tenth_of_an_edge_deep(seed, caplog):
    """No node is touched; at eighths of the edge, beside the tip, the flanks are higher by a thirty-second of it."""
    rng = np.random.default_rng(seed)
    place, fillet = 6.0 + float(rng.uniform(0.35, 0.65)), float(rng.uniform(0.02, 0.1))
    # the fillet of two flanks at ±atan(1/2) ends by R (1/cos − 1) above the corner
    blunt = fillet * (np.hypot(1.0, 0.5) - 1.0)
    short, deep = 0.08, 0.16
    assert not said(wedge(fillet, place, blunt + short, 1.0), caplog)
    (words,) = said(wedge(fillet, place, blunt + deep, 1.0), caplog)
    assert "tool 'tip' lies more than 0.1 inside 'block' between nodes" in words


def test_a_needle_is_found_behind_the_edge_though_it_is_thin(caplog):
    """No place in it is deeper than half its width."""
    problem = pr.Problem(
        "needle", bodies={"block": pr.Body(pr.Rectangle((12.0, 8.0), n=(6, 4)), pr.Elastic(1000.0, 0.3))},
        tools={"tip": pr.Polygon(points=((7.0, 8.0), (7.3, 20.0), (6.7, 20.0)), fillet=0.05, at=(0.0, 0.0))},
        fixed={"block.bottom": "xy"}, steps=[pr.Step("press", move={"tip": {"y": -3.0}}, increments=6)],
    )  # fmt: skip
    (words,) = said(problem, caplog)
    assert "lies more than 0.2 inside 'block' between nodes" in words


def test_round_tools_of_elements_that_find_them_are_silent(caplog):
    """A roll over a chord of an element as long as half of its radius rises by a sixteenth of it."""
    problem = pr.Problem(
        "roll", bodies={"block": pr.Body(pr.Rectangle((12.0, 4.0), n=(12, 4)), pr.Elastic(1000.0, 0.3))},
        tools={"roll": pr.Circle(radius=2.0, at=(6.5, 6.0))}, fixed={"block.bottom": "xy"},
        steps=[pr.Step("press", move={"roll": {"y": -0.6}}, increments=4)],
    )  # fmt: skip
    assert not said(problem, caplog)
