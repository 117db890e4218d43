"""Calibration files: the tests, what was observed in them and what is sought, with file, line and column of every mistake."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from prensa.errors import CaseError, Mark, Mistake, PrensaError
from prensa.inverse.experiment import Experiment, Observe, Test, ready, refuse_twice, refuse_vague
from prensa.inverse.objective import Parameter
from prensa.model import text as yaml
from prensa.model.names import suggest_key
from prensa.model.schema import load
from prensa.sensitivity.parameters import value_of

Node = yaml.Node
FLAGS = ("refine", "compare", "profiles")
CALIBRATION_KEYS = ("name", "tests", "parameters", "starts", "seed", *FLAGS)
TEST_KEYS = ("case", "set", "data", "along", "column", "scale", "offset", "name", "observe")
OBSERVE_KEYS = ("measure", "sigma", "scale", "shift", "gain")


@dataclass(frozen=True)
class Calibration:
    """What a calibration file says: its ``tests``, bounds of ``parameters`` by path, and how to go about it."""

    name: str
    tests: tuple[Test, ...]
    parameters: dict[str, tuple[float, float] | None]
    starts: int = 1
    seed: int = 0
    refine: bool = True
    compare: bool = True
    profiles: bool = True
    experiments: tuple[Experiment, ...] = field(default=(), compare=False)


def read_calibration(path: str | Path, overrides: Iterable[str] = ()) -> Calibration:
    """Read a calibration file, its cases and its tables; paths in it are relative to its folder.

    ``overrides``: changes of all cases, as ``--set`` makes them.

    Raises
    ------
    CaseError
        With the mistakes of the file, one a line: ``file.yaml:12:5: message; remedy``; of a case, those of the case.

    """
    path = Path(path)
    tree, known = yaml.read(yaml.content_of(path), str(path))
    reader = _Reader(path, list(overrides), list(known))
    found = reader.calibration(tree)
    if found is None or reader.mistakes:
        raise CaseError(sorted(reader.mistakes))
    return found


class _Reader:
    """Reads nodes and collects what is wrong with them."""

    def __init__(self, path: Path, overrides: list[str], mistakes: list[Mistake]) -> None:
        self.path, self.overrides, self.mistakes = path, overrides, mistakes

    def wrong(self, node: Node | Mark, message: str) -> None:
        """Keep a mistake."""
        self.mistakes.append(Mistake(node if isinstance(node, Mark) else node.mark, message))

    # ------------------------------------------------------------------------------------------------------- what is read
    def calibration(self, tree: Node) -> Calibration | None:
        """The file; None, with mistakes kept, where it cannot be made."""
        top = self.mapping(tree, "a calibration", CALIBRATION_KEYS, needs=("tests", "parameters"))
        tests = self.tests(top["tests"]) if "tests" in top else []
        # Whether parameters and tests fit together is looked at where the tests themselves are sound.
        broken = bool(self.mistakes)
        bounds = self.parameters(top["parameters"]) if "parameters" in top else {}
        starts = self.whole(top.get("starts"), "starts", 1)
        seed = self.whole(top.get("seed"), "seed", 0)
        refine, compare, profiles = (self.flag(top.get(key), key) for key in FLAGS)
        name = self.word(top.get("name"), "name") or self.path.stem
        experiments = [self.experiment(test, node, k) for k, (test, node) in enumerate(tests, 1)]
        sound = [e for e in experiments if e is not None]
        if len(sound) == len(tests) and "parameters" in top and not broken:
            self.against(sound, bounds, top["parameters"])
        if self.mistakes:
            return None
        return Calibration(
            name, tuple(t for t, _ in tests), bounds, starts, seed, refine, compare, profiles, tuple(sound)
        )  # fmt: skip

    def tests(self, node: Node) -> list[tuple[Test, Node]]:
        """Tests with their nodes."""
        if not isinstance(node.value, list) or not node.value:
            self.wrong(node, f"tests is {node.shown()}; give a list, each with 'case', 'data' and 'observe'")
            return []
        return [(test, item) for item in node.value if (test := self.test(item)) is not None]

    def test(self, node: Node) -> Test | None:
        """A test; None where it cannot be made."""
        before = len(self.mistakes)
        keys = self.mapping(node, "a test", TEST_KEYS, needs=("case", "data", "observe"))
        case_file, data = self.word(keys.get("case"), "case"), self.word(keys.get("data"), "data")
        changes = self.words(keys.get("set"), "set")
        observe = self.observe(keys["observe"]) if "observe" in keys else {}
        along = self.word(keys.get("along"), "along") or "time"
        offset = self.number(keys.get("offset"), "offset", 0.0)
        scale = self.number(keys.get("scale"), "scale", 1.0)
        column, name = (self.word(keys.get(key), key) for key in ("column", "name"))
        if len(self.mistakes) > before or case_file is None or data is None:
            return None
        case = self.kept(keys["case"], lambda: load(self.path.parent / case_file, [*changes, *self.overrides]))
        if case is None:
            return None
        return self.kept(node, lambda: Test(case, self.path.parent / data, observe, along, column, offset, name or "", scale))

    def observe(self, node: Node) -> dict[str, Observe | str]:
        """Observations by column."""
        if not isinstance(node.value, dict) or not node.value:
            self.wrong(node, f"observe is {node.shown()}; give measures by column, as in 'force: die.force.y'")
            return {}
        return {column: o for column, below in node.value.items() if (o := self.observation(below)) is not None}

    def observation(self, node: Node) -> Observe | None:
        """An observation: a measure, or a mapping."""
        if not isinstance(node.value, dict):
            measure = self.word(node, "a column")
            return None if measure is None else Observe(measure)
        before = len(self.mistakes)
        keys = self.mapping(node, "an observation", OBSERVE_KEYS, needs=("measure",))
        measure = self.word(keys.get("measure"), "measure")
        sigma: Any = keys["sigma"].value if "sigma" in keys else "1 %"
        gain: Any = keys["gain"].value if "gain" in keys else None
        for key, value in (("sigma", sigma), ("gain", gain)):
            if isinstance(value, dict | list | bool) or (value is None and key == "sigma"):
                self.wrong(keys[key], f"{key} is {keys[key].shown()}; write a number or a share such as '1 %'")
        scale = self.number(keys.get("scale"), "scale", 1.0)
        shift = self.number(keys.get("shift"), "shift", 0.0)
        if len(self.mistakes) > before or measure is None:
            return None
        return self.kept(node, lambda: Observe(measure, sigma, scale, gain, shift))

    def parameters(self, node: Node) -> dict[str, tuple[float, float] | None]:
        """Bounds by path."""
        if isinstance(node.value, list):
            return {str(item.value): None for item in node.value if self.word(item, "a parameter") is not None}
        if not isinstance(node.value, dict) or not node.value:
            self.wrong(node, f"parameters is {node.shown()}; give bounds by path, as in 'friction.mu: [0.02, 0.5]'")
            return {}
        out: dict[str, tuple[float, float] | None] = {}
        for path, below in node.value.items():
            pair = below.value
            if pair is None:
                out[path] = None
            elif isinstance(pair, list) and len(pair) == 2 and all(_is_number(n.value) for n in pair):
                out[path] = float(pair[0].value), float(pair[1].value)
            else:
                self.wrong(below, f"{path} has bounds {below.shown()}; write two numbers, as in [0.02, 0.5], or nothing")
        return out

    # ------------------------------------------------------------------------------------------------- what fits together
    def experiment(self, test: Test, node: Node, number: int) -> Experiment | None:
        """A test with its table; None, with the reason kept, where they do not fit."""
        found: Experiment | None = self.kept(node, lambda: ready(test, number))
        if found is not None:
            self.kept(node, lambda: refuse_vague(found))
        return found

    def against(self, experiments: list[Experiment], bounds: dict[str, tuple[float, float] | None], node: Node) -> None:
        """Parameters that do not exist or start outside their bounds, and too few readings."""
        for path, pair in bounds.items():
            mark = node.keys.get(path, node.mark)
            for e in experiments:
                self.kept(mark, partial(_parameter, e, path, pair))
        self.kept(node, lambda: refuse_twice(experiments))
        readings = sum(e.count for e in experiments)
        if bounds and readings <= len(bounds):
            self.wrong(node, f"{readings} readings cannot determine {len(bounds)} parameters; take more, or fit fewer")

    def kept(self, place: Node | Mark, make: Callable[[], Any]) -> Any:
        """What is made; None, with what is wrong kept, where it cannot be."""
        try:
            return make()
        except CaseError as error:
            self.mistakes += error.mistakes
        except PrensaError as error:
            self.wrong(place, str(error).splitlines()[0])
        return None

    # -------------------------------------------------------------------------------------------------------------- kinds
    def mapping(self, node: Node, what: str, keys: tuple[str, ...], needs: tuple[str, ...]) -> dict[str, Node]:
        """Nodes by key, of known keys only."""
        if not isinstance(node.value, dict):
            self.wrong(node, f"{what} is {node.shown()}; it is a mapping with {', '.join(map(repr, needs))}")
            return {}
        for key in node.value:
            if key not in keys:
                self.wrong(node.keys.get(key, node.mark), f"unknown key {key!r} in {what}{suggest_key(key, keys)}")
        for key in needs:
            if key not in node.value:
                self.wrong(node, f"{what} needs {key!r}")
        return {key: below for key, below in node.value.items() if key in keys}

    def word(self, node: Node | None, what: str) -> str | None:
        """A text; None where there is none."""
        if node is None:
            return None
        if not isinstance(node.value, str) or not node.value.strip():
            self.wrong(node, f"{what} is {node.shown()}; write a text")
            return None
        return node.value.strip()

    def words(self, node: Node | None, what: str) -> list[str]:
        """Texts: a list, or one."""
        if node is None:
            return []
        items = node.value if isinstance(node.value, list) else [node]
        return [w for item in items if (w := self.word(item, what)) is not None]

    def number(self, node: Node | None, what: str, default: float) -> float:
        """A number, or what stands for none."""
        if node is None:
            return default
        if not _is_number(node.value):
            self.wrong(node, f"{what} is {node.shown()}; write a number, in the unit of the column")
            return default
        return float(node.value)

    def whole(self, node: Node | None, what: str, least: int) -> int:
        """A whole number that is not less than *least*."""
        if node is None:
            return least
        if isinstance(node.value, bool) or not isinstance(node.value, int) or node.value < least:
            self.wrong(node, f"{what} is {node.shown()}; write a whole number, {least} or more")
            return least
        return node.value

    def flag(self, node: Node | None, what: str) -> bool:
        """True or false, true if nothing is said."""
        if node is None:
            return True
        if not isinstance(node.value, bool):
            self.wrong(node, f"{what} is {node.shown()}; write true or false")
            return True
        return node.value


def _parameter(e: Experiment, path: str, pair: tuple[float, float] | None) -> Parameter:
    return Parameter.of(path, value_of(e.problem, path), pair)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
