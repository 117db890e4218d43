"""Values of a quantity as they may be written, and which cases come of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from prensa.errors import PrensaError
from prensa.study.plan import Plan, unit_samples
from prensa.study.values import Scatter, Values, factor, factors_of, split_changes, value_of


@pytest.mark.parametrize(
    ("given", "texts"),
    [
        ("0, 0.05,0.1", ("0", "0.05", "0.1")),
        ("lin(0.1,0.3,5)", ("0.1", "0.15", "0.2", "0.25", "0.3")),
        ("log(1, 100, 3)", ("1", "10", "100")),
        ("log(-1, -100, 3)", ("-1", "-10", "-100")),
        ("lin(1 mm, 2 mm, 3)", ("1 mm", "1.5 mm", "2 mm")),
        ("0, lin(0.1, 0.2, 2), 1", ("0", "0.1", "0.2", "1")),
        ("[20, 30], [40, 60]", ("[20, 30]", "[40, 60]")),
        ("{type: coulomb, mu: 0.1}, {type: shear, m: 0.2}", ("{type: coulomb, mu: 0.1}", "{type: shear, m: 0.2}")),
        ("'a, b', c", ("'a, b'", "c")),
        ("1, 1", ("1",)),
        ("lin(2, 2, 1)", ("2",)),
    ],
)
def test_lists_and_ranges(given: str, texts: tuple[str, ...]) -> None:
    """Values are split at the commas outside brackets and quotes; ranges stand for theirs, without digits of round-off."""
    assert factor("a.b", given) == Values("a.b", texts)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("", "there is no value"),
        ("1,,2", "a value is missing between two commas"),
        ("lin(0,1)", "write lin(a, b, n)"),
        ("lin(0,1,0)", "at least 1"),
        ("lin(0,1,2.5)", "whole number"),
        ("lin(0,1,1)", "give at least 2"),
        ("lin(0,x,3)", "'x' is not a number"),
        ("log(0,1,3)", "neither to zero"),
        ("lin(1 mm,2,3)", "several units"),
        ("lon(1,2,3)", "unknown range or distribution 'lon'"),
        ("Normal(1,2)", "small letters"),
        ("normal(1,0)", "must be positive"),
        ("normal(1,1,3,2)", "is not an interval"),
        ("normal(1,1), 3", "stands alone"),
        ("uniform(2,1)", "is not an interval"),
        ("lognormal(-1,1)", "must be positive"),
        ("loguniform(0,1)", "must be positive"),
        ("triangular(0,2,1)", "must increase"),
        ("normal(1e400,1)", "not finite"),
    ],
)
def test_what_is_written_wrongly_is_refused(given: str, words: str) -> None:
    """A value that means nothing is refused with the form that is meant."""
    with pytest.raises(PrensaError, match=r"--set a\.b=") as error:
        factor("a.b", given)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("given", "mean", "sd"),
    [
        ("normal(70 GPa, 3 %)", 70.0, 2.1),
        ("normal(5, 2)", 5.0, 2.0),
        ("lognormal(3, 0.6)", 3.0, 0.6),
        ("uniform(1, 4)", 2.5, 3 / 12**0.5),
        ("triangular(0, 3, 6)", 3.0, 3 / 6**0.5),
        ("loguniform(1, 10)", 9 / np.log(10), (99 / (2 * np.log(10)) - (9 / np.log(10)) ** 2) ** 0.5),
    ],
)
def test_distributions_have_the_moments_that_their_words_say(given: str, mean: float, sd: float) -> None:
    """Mean and standard deviation of what is written are those of the textbook's closed forms."""
    found = factor("x", given)
    assert isinstance(found, Scatter)
    assert found.law.mean() == pytest.approx(mean, rel=1e-9)
    assert found.law.std() == pytest.approx(sd, rel=1e-9)


def test_samples_are_written_with_their_unit_and_read_back() -> None:
    """A sample is the quantile of its share, in the unit of the distribution; tails may be cut off."""
    law = factor("x", "normal(70 GPa, 2 GPa, 68 GPa, 72 GPa)")
    assert isinstance(law, Scatter) and law.unit == "GPa"
    texts = law.at(np.array([0.0, 0.5, 1.0]))
    assert [value_of(law, t) for t in texts] == pytest.approx([68, 70, 72])
    assert texts[1] == "70 GPa"


def test_python_objects() -> None:
    """Lists, arrays, single values, texts and distributions of scipy.stats stand for themselves."""
    given = {
        "a": [1, 2.5],
        "b": np.linspace(0, 1, 3),
        "c": 3,
        "d": "lin(0,1,2)",
        "e": [[2, 3], (4, 5)],
        "f": {"type": "exact"},
    }
    texts = [f.texts for f in factors_of(given) if isinstance(f, Values)]
    assert texts == [("1", "2.5"), ("0", "0.5", "1"), ("3",), ("0", "1"), ("[2, 3]", "[4, 5]"), ("{type: exact}",)]
    (scatter,) = factors_of({"g": stats.norm(1, 2)})
    assert isinstance(scatter, Scatter) and scatter.text == "norm(1, 2)"
    for wrong, words in (
        ({"a": []}, "no values"),
        ({"a": [float("nan")]}, "finite"),
        ({"a": [object()]}, "give numbers"),
    ):
        with pytest.raises(PrensaError, match=words):
            factors_of(wrong)


def test_a_change_without_a_value_or_given_twice_is_refused() -> None:
    """``path=values``, each path once."""
    assert split_changes(["a.b=1,2", "c = x"]) == {"a.b": "1,2", "c": "x"}
    with pytest.raises(PrensaError, match="path=values"):
        split_changes(["a.b"])
    with pytest.raises(PrensaError, match="given twice"):
        split_changes(["a=1", "a=2"])


# ------------------------------------------------------------------------------------------------------------ the plan
def test_a_plan_is_the_full_grid_and_the_same_samples_at_each_point() -> None:
    """Every combination occurs once, and what scatters has the same values at each of them."""
    plan = Plan((factor("a", "1,2,3"), factor("s", "normal(0,1)"), factor("b", "x,y")), samples=4)
    points = list(plan.points())
    assert len(points) == plan.count == 24
    grid = [(p.values["a"], p.values["b"]) for p in points[::4]]
    assert grid == [(a, b) for a in "123" for b in "xy"]
    first = [p.values["s"] for p in points[:4]]
    assert all([p.values["s"] for p in points[k : k + 4]] == first for k in range(0, 24, 4))
    assert points[5].sample == 1 and points[5].changes[0] == "a=1"
    assert list(points[0].values) == ["a", "s", "b"]


@pytest.mark.parametrize("sampling", ["sobol", "random"])
def test_more_samples_keep_the_first_ones(sampling: str) -> None:
    """The first samples of a longer sequence are those of the shorter: what is computed is not computed again."""
    few, many = (unit_samples(sampling, n, 3, 5) for n in (8, 16))  # type: ignore[arg-type]
    assert np.array_equal(few, many[:8])
    assert not np.array_equal(few, unit_samples(sampling, 8, 3, 6))  # type: ignore[arg-type]


def test_latin_hypercubes_have_one_sample_in_each_layer() -> None:
    """Of n Latin hypercube samples each nth of every quantity holds one."""
    x = unit_samples("lhs", 10, 2, 0)
    assert np.array_equal(np.sort(np.floor(10 * x), axis=0), np.tile(np.arange(10.0)[:, None], 2))


def test_sobol_samples_find_mean_and_quantiles() -> None:
    """256 Sobol samples of two normal quantities have the mean, deviation and quantiles of their sum to a few thousandths."""
    plan = Plan((factor("a", "normal(1, 0.3)"), factor("b", "normal(2, 0.4)")), samples=256)
    total = np.array([float(p.values["a"]) + float(p.values["b"]) for p in plan.points()])
    law = stats.norm(3, 0.5)
    assert total.mean() == pytest.approx(3, abs=2e-3)
    assert total.std() == pytest.approx(0.5, rel=2e-2)
    assert np.quantile(total, [0.05, 0.5, 0.95]) == pytest.approx(law.ppf([0.05, 0.5, 0.95]), abs=0.03)


@pytest.mark.parametrize(
    ("given", "options", "words"),
    [
        ("1,2", {"samples": 8}, "nothing is scattered"),
        ("normal(0,1)", {"samples": 10}, "give 8 or 16"),
        ("normal(0,1)", {"samples": 1}, "at least 2"),
        ("normal(0,1)", {"sampling": "halton"}, "unknown sampling 'halton'"),
        ("lin(0,1,1000)", {"more": "lin(0,1,1000)"}, "1000000 cases"),
    ],
)
def test_plans_that_cannot_be_are_refused(given: str, options: dict[str, object], words: str) -> None:
    """Numbers of samples and cases that make no sense are refused before anything is computed."""
    factors = [factor("a", given)] + ([factor("b", str(options.pop("more")))] if "more" in options else [])
    with pytest.raises(PrensaError, match=words):
        Plan(tuple(factors), **options)  # type: ignore[arg-type]
