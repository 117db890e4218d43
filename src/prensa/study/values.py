"""Values of a quantity in a sweep: lists and ranges, or a distribution, as text and as Python objects.

=============================================  ===========================================================================
``0, 0.05, 0.1``                               these values
``lin(a, b, n)``                               n values from a to b, equally spaced
``log(a, b, n)``                               the same, in equal ratios
``uniform(low, high)``                         scatter, every value between equally likely
``loguniform(low, high)``                      the same of the logarithm
``triangular(low, mode, high)``                scatter with its most likely value
``normal(mean, sd)``                           scatter; ``normal(mean, sd, low, high)`` cuts the tails off
``lognormal(mean, sd)``                        scatter of what is positive; mean and standard deviation of the value itself
=============================================  ===========================================================================

Numbers may have units (``lin(1 mm, 2 mm, 5)``, ``normal(70 GPa, 2 GPa)``), a standard deviation may be a share of the mean
(``normal(70 GPa, 3 %)``). Values with commas of their own stand in brackets: ``[20, 30], [40, 60]``.
"""

from __future__ import annotations

import itertools
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from prensa.errors import PrensaError, shown
from prensa.measures.grammar import DEEPEST
from prensa.model import text as yaml

MOST_CASES = 100_000  # of a study, and values of one factor
MOST_PARTS = 20_000  # numbers, texts and lists that one value is made of
RANGES = {"lin": "lin(a, b, n)", "log": "log(a, b, n)"}
DISTRIBUTIONS = {
    "uniform": "uniform(low, high)", "loguniform": "loguniform(low, high)", "triangular": "triangular(low, mode, high)",
    "normal": "normal(mean, sd) or normal(mean, sd, low, high)", "lognormal": "lognormal(mean, sd)",
}  # fmt: skip
_FUNCTION = re.compile(r"([A-Za-z]\w*)\s*\((.*)\)", re.DOTALL)
_NUMBER_AND_UNIT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)
_DIGITS = 12  # of the values of ranges and samples: what a reader takes for 0.15 is not 0.15000000000000002


@dataclass(frozen=True)
class Values:
    """Values of the quantity *path*, as YAML texts in the order given."""

    path: str
    texts: tuple[str, ...]

    @cached_property
    def unit(self) -> str:
        """The unit that all values are written with; empty if none, or several."""
        units = {found[1] if (found := number_and_unit(t)) else None for t in self.texts}
        return (units.pop() or "") if len(units) == 1 else ""


@dataclass(frozen=True)
class Scatter:
    """The quantity *path* is scattered: ``law`` is a frozen distribution of scipy.stats, ``text`` says it in words."""

    path: str
    law: Any
    text: str
    unit: str = ""

    def at(self, shares: np.ndarray) -> list[str]:
        """YAML texts of the quantiles at *shares*, between 0 and 1."""
        tiny = 2.0**-40  # a sample at 0 or 1 would be infinite
        numbers = self.law.ppf(np.clip(shares, tiny, 1 - tiny))
        return [_written(float(v), self.unit) for v in numbers]


Factor = Values | Scatter


def number_and_unit(text: str) -> tuple[float, str] | None:
    """The number and the unit of a text such as ``3 mm``; None of anything else."""
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None or not re.fullmatch(r"[^\d,;:\[\]{}()]*(\^\d)?", match[2]):
        return None
    return float(match[1]), match[2].strip()


def value_of(factor: Factor, text: str) -> float | int | str:
    """A value of a factor: a number where it is one, in the unit that all of them have; else the text."""
    found = number_and_unit(text)
    if found is None or found[1] != factor.unit:
        return text
    number = found[0]
    return int(number) if re.fullmatch(r"[-+]?\d{1,15}", text.strip()) else number


def factor(path: str, given: str) -> Factor:
    """What *given* says of the quantity *path*, in the words of this module's table.

    Raises
    ------
    PrensaError
        If nothing is given or a range or distribution is written wrongly.

    """
    parts = [part.strip() for part in _split(given)]
    where = f"--set {path}={given}"
    if parts == [""]:
        raise PrensaError(f"{where}: there is no value; give some, such as {path}=0,0.1 or {path}=lin(0, 0.1, 5)")
    if "" in parts:
        raise PrensaError(f"{where}: a value is missing between two commas; leave the comma out or write null")
    texts: list[str] = []
    for part in parts:
        name, arguments = _call(part)
        if name in DISTRIBUTIONS:
            if len(parts) > 1:
                raise PrensaError(f"{where}: a distribution stands alone; leave the other values out")
            return _scatter(path, name, arguments, where)
        if name in RANGES:
            texts += _range(name, arguments, where)
        elif name and name.lower() in (*DISTRIBUTIONS, *RANGES):
            raise PrensaError(f"{where}: write {name.lower()!r} in small letters")
        elif name:
            known = ", ".join(map(repr, (*RANGES, *DISTRIBUTIONS)))
            raise PrensaError(f"{where}: unknown range or distribution {name!r}; known: {known}")
        else:
            texts.append(part)
    if len(texts) > MOST_CASES:
        raise PrensaError(f"{where}: {len(texts)} values; at most {MOST_CASES} are taken")
    return Values(path, tuple(dict.fromkeys(texts)))


def split_changes(changes: Iterable[str]) -> dict[str, str]:
    """Values by path of texts ``path=values``.

    Raises
    ------
    PrensaError
        If one has no ``=``, or two are of one path.

    """
    found: dict[str, str] = {}
    for text in changes:
        path, equals, given = (part.strip() for part in text.partition("="))
        if not equals or not path:
            raise PrensaError(f"--set {text}: write it as path=values, for example friction.mu=0,0.05,0.1")
        if path in found:
            raise PrensaError(f"--set {text}: {path!r} is given twice; write all its values at once, with commas")
        found[path] = given
    return found


def levels_of(name: str, given: str | None) -> list[float] | bool:
    """Levels of a convergence study as they are written, ``0.5,1,2`` or a range; True of ``auto``, False of nothing.

    Raises
    ------
    PrensaError
        If they are no numbers.

    """
    if given is None or given.strip() == "auto":
        return given is not None
    try:
        found = factor(name, given)
        return [float(t) for t in found.texts] if isinstance(found, Values) else [float("nan")]
    except ValueError:
        raise PrensaError(
            f"--{name} {given}: give factors of the case's own fineness, such as 0.5,1,2, or auto"
        ) from None


def factors_of(values: Mapping[str, Any]) -> list[Factor]:
    """Factors of a Python mapping from paths to a value, a sequence of values, a text, or a distribution of scipy.stats."""
    return [_of_object(path, value) for path, value in values.items()]


def _of_object(path: str, value: Any) -> Factor:
    if not isinstance(path, str) or not path:
        raise PrensaError(f"sweep: {shown(path)} is not a path; give texts such as 'friction.mu'")
    if isinstance(value, str):
        return factor(path, value)
    if callable(getattr(value, "ppf", None)):
        name = getattr(getattr(value, "dist", value), "name", type(value).__name__)
        arguments = ", ".join(map(str, (*getattr(value, "args", ()), *getattr(value, "kwds", {}).values())))
        return Scatter(path, value, f"{name}({arguments})")
    if isinstance(value, np.ndarray) and not value.ndim:
        value = value.item()
    if isinstance(value, Mapping) or not isinstance(value, Iterable):
        value = [value]
    texts = [_text(path, v) for v in value]
    if not texts:
        raise PrensaError(f"sweep: {path} has no values; give at least one")
    return Values(path, tuple(dict.fromkeys(texts)))


def _text(path: str, value: Any) -> str:
    value = _plain(path, value, itertools.count())
    return value if isinstance(value, str) else yaml.line(value)


def _plain(path: str, value: Any, parts: Iterator[int], depth: int = 0) -> Any:
    """A value of Python, as YAML can have it; ``parts`` counts what it is made of, which may be itself."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if next(parts) > MOST_PARTS or depth > DEEPEST:
        raise PrensaError(
            f"sweep: {path} has a value of more than {MOST_PARTS} parts, or {DEEPEST} inside one another; name a file instead"
        )
    if isinstance(value, int | float) and not abs(value) <= sys.float_info.max:
        raise PrensaError(f"sweep: {path} has the value {shown(value)}; every number of a case is finite")
    if isinstance(value, tuple | list):
        return [_plain(path, v, parts, depth + 1) for v in value]
    if isinstance(value, dict) and all(isinstance(k, str) for k in value):
        return {k: _plain(path, v, parts, depth + 1) for k, v in value.items()}
    if value is not None and not isinstance(value, bool | int | float | str):
        raise PrensaError(f"sweep: {path} has the value {shown(value)}; give numbers, texts, lists or mappings with names")
    return value


# --------------------------------------------------------------------------------------------------------------- reading
def _split(text: str) -> Iterator[str]:
    """Parts between the commas that stand in no bracket and no quotation."""
    depth, quote, start = 0, "", 0
    for k, c in enumerate(text):
        if quote:
            quote = "" if c == quote else quote
        elif c in "\"'":
            quote = c
        elif c in "([{":
            depth += 1
        elif c in ")]}":
            depth -= 1
        elif c == "," and depth <= 0:
            yield text[start:k]
            start = k + 1
    yield text[start:]


def _call(part: str) -> tuple[str, list[str]]:
    match = _FUNCTION.fullmatch(part)
    return (match[1], [a.strip() for a in _split(match[2])]) if match else ("", [])


def _numbers(arguments: list[str], where: str, form: str) -> tuple[list[float], str]:
    """Numbers and their common unit; a last argument in per cent is a share of the first."""
    found = [_NUMBER_AND_UNIT.fullmatch(a) for a in arguments]
    for argument, match in zip(arguments, found):
        if match is None:
            raise PrensaError(f"{where}: {argument!r} is not a number; write {form}")
    pairs = [(float(m[1]), m[2].strip()) for m in found if m]
    if any(not math.isfinite(v) for v, _ in pairs):
        raise PrensaError(f"{where}: a number is not finite; write {form}")
    if len(pairs) > 1 and pairs[1][1] == "%" and "sd" in form:
        pairs[1] = (abs(pairs[0][0]) * pairs[1][0] / 100, pairs[0][1])
    units = {unit for _, unit in pairs}
    if len(units) > 1:
        summary = ", ".join(sorted(repr(u) if u else "none" for u in units))
        raise PrensaError(f"{where}: the numbers have several units ({summary}); give them all the same")
    return [v for v, _ in pairs], units.pop() if units else ""


def _range(name: str, arguments: list[str], where: str) -> list[str]:
    form = RANGES[name]
    if len(arguments) != 3:
        raise PrensaError(f"{where}: write {form}: from, to, and how many")
    if not re.fullmatch(r"\d{1,6}", arguments[2]) or int(arguments[2]) < 1:
        raise PrensaError(f"{where}: {arguments[2]!r} values; {form} takes a whole number of at least 1 as the last")
    (a, b), unit = _numbers(arguments[:2], where, form)
    count = int(arguments[2])
    if count == 1 and a != b:
        raise PrensaError(f"{where}: one value from {a:g} to {b:g}; give at least 2, or {name}(a, a, 1)")
    if name == "log" and not a * b > 0:
        raise PrensaError(f"{where}: equal ratios lead neither to zero nor through it; give two numbers of one sign")
    numbers = np.linspace(a, b, count) if name == "lin" else np.geomspace(a, b, count)
    return [_written(float(v), unit) for v in numbers]


def _scatter(path: str, name: str, arguments: list[str], where: str) -> Scatter:
    form = DISTRIBUTIONS[name]
    counts = {"triangular": (3,), "normal": (2, 4)}.get(name, (2,))
    if len(arguments) not in counts:
        raise PrensaError(f"{where}: write {form}")
    v, unit = _numbers(arguments, where, form)
    return Scatter(path, _law(name, v, where, form), f"{name}({', '.join(arguments)})", unit)


def _law(name: str, v: list[float], where: str, form: str) -> Any:
    """The distribution of scipy.stats."""
    from scipy import stats

    def need(holds: bool, words: str) -> None:
        if not holds:
            raise PrensaError(f"{where}: {words}; write {form}")

    if name in ("uniform", "loguniform"):
        need(v[0] < v[1], f"from {v[0]:g} to {v[1]:g} is not an interval")
        need(name == "uniform" or v[0] > 0, "both ends must be positive")
        return stats.uniform(v[0], v[1] - v[0]) if name == "uniform" else stats.loguniform(v[0], v[1])
    if name == "triangular":
        need(v[0] <= v[1] <= v[2] and v[0] < v[2], "the numbers must increase")
        return stats.triang((v[1] - v[0]) / (v[2] - v[0]), v[0], v[2] - v[0])
    mean, sd = v[:2]
    need(sd > 0, f"the standard deviation is {sd:g} and must be positive")
    if name == "lognormal":
        need(mean > 0, f"the mean is {mean:g} and must be positive")
        spread = math.log1p((sd / mean) ** 2)  # variance of the logarithm
        return stats.lognorm(math.sqrt(spread), scale=mean * math.exp(-0.5 * spread))
    if len(v) == 2:
        return stats.norm(mean, sd)
    need(v[2] < v[3], f"from {v[2]:g} to {v[3]:g} is not an interval")
    return stats.truncnorm((v[2] - mean) / sd, (v[3] - mean) / sd, mean, sd)


def _written(value: float, unit: str) -> str:
    """A number as it may stand in a case."""
    # Twelve digits, for the text is the case's key: the same value must not be another case for its last bit.
    number = float(f"{value:.{_DIGITS}g}")
    text = str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)
    return f"{text} {unit}".rstrip()
