"""The documentation is true: its code runs, its cases are valid, its links lead somewhere, its places exist."""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import importlib.util
import io
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight, staircase
from prensa.errors import CaseError
from prensa.inverse.files import read_calibration
from prensa.model import problem as vocabulary
from prensa.model.plausibility import warnings_of
from prensa.model.schema import loads
from prensa.registry import public
from prensa.verify import table

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "prensa"
DOCS = ROOT / "docs"
LAB = DOCS / "lab"  # decision records as they were written; not on the site, and the code that they name may be gone
PAGES = [
    *(ROOT / n for n in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted(p for p in DOCS.rglob("*.md") if LAB not in p.parents),
]
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
EXPECTED_WARNINGS = {  # by page, what is said of its cases and is true: few elements lie under the roll of the strip that is fed
    "cases.md": ("about 4 elements lie in the contact",),
}
CLOSE = 1e-3  # relative difference allowed between a printed number and the one in the text


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def blocks(path: Path) -> list[tuple[str, str, int]]:
    """Language, text and place of the fenced blocks of a page."""
    text = path.read_text(encoding="utf-8")
    return [(m[1].strip(), m[2], m.end()) for m in FENCE.finditer(text)]


def prose(path: Path) -> str:
    return FENCE.sub("", path.read_text(encoding="utf-8"))


def having(*languages: str) -> list[object]:
    return [pytest.param(p, id=name_of(p)) for p in PAGES if any(b[0] in languages for b in blocks(p))]


# ------------------------------------------------------------------------------------------------------ code that runs
@pytest.mark.parametrize("path", having("python"))
def test_python_blocks_run_and_print_what_the_page_says(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The Python of a page runs from top to bottom, and prints the text block that stands right after it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(table, "_CASES", dict(table.cases()))  # a page may show how to add one
    text, scope, found = path.read_text(encoding="utf-8"), {}, blocks(path)  # type: ignore[var-annotated]
    for k, (language, code, end) in enumerate(found):
        if language != "python":
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), table.heard() as warnings:
            exec(compile(code, f"{name_of(path)} block {k}", "exec", dont_inherit=True), scope)
        if text[end:].lstrip("\n").startswith("```text\n"):
            same(printed.getvalue(), found[k + 1][1])
        assert not warnings, "what a page shows has nothing told of it"
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")  # a page may leave its figures open, other tests may not find them


def same(ours: str, said: str) -> None:
    """The words are the same, and the numbers nearly."""
    assert NUMBER.sub("#", ours).split() == NUMBER.sub("#", said).split()
    for a, b in zip(NUMBER.findall(ours), NUMBER.findall(said), strict=True):
        assert float(a) == pytest.approx(float(b), rel=CLOSE)


@pytest.mark.parametrize("path", having("yaml", "yaml fragment"))
def test_cases_are_valid_and_nothing_is_said_against_them(path: Path) -> None:
    """A ``yaml`` block is a whole case; a ``yaml fragment`` replaces keys of the first case of its page; both could be run."""
    from ruamel.yaml import YAML

    base: dict[str, object] = {}
    for language, text, _ in blocks(path):
        if not language.startswith("yaml") or language == "yaml calibration":
            continue
        keys = YAML(typ="safe", pure=True).load(text)
        base = base or keys
        whole = io.StringIO()
        YAML(typ="safe", pure=True).dump({**base, **keys} if "fragment" in language else keys, whole)
        case = loads(text if language == "yaml" else whole.getvalue(), name_of(path))
        system = pr.discretise(case.problem)
        said = [*warnings_of(case.problem), *map(str, preflight(system)), *map(str, staircase(system))]
        assert [words for words in said if not any(part in words for part in EXPECTED_WARNINGS.get(path.name, ()))] == []


@pytest.mark.parametrize("path", having("yaml calibration"))
def test_calibrations_are_valid(path: Path, tmp_path: Path) -> None:
    """A ``yaml calibration`` block is one of the cases and tables in examples/calibration."""
    for file in (ROOT / "examples" / "calibration").glob("*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    for language, text, _ in blocks(path):
        if language == "yaml calibration":
            (tmp_path / "page.yaml").write_text(text, encoding="utf-8")
            assert read_calibration(tmp_path / "page.yaml").experiments


def test_the_tutorial_describes_one_problem_in_two_ways() -> None:
    """File and script of the first case are the same problem, and the mistake shown is reported as the page says."""
    found = blocks(DOCS / "guide" / "first-case.md")
    case = next(text for language, text, _ in found if language == "yaml")
    scope: dict[str, object] = {}
    exec(next(text for language, text, _ in found if language == "python"), scope)
    assert loads(case).problem == scope["problem"]
    with pytest.raises(CaseError) as caught:
        loads(case.replace("radius: 8 cm", "radus: 8 cm"), "cylinder.yaml")
    said = next(text for language, text, _ in found if language == "text" and "radus" in text)
    assert str(caught.value) == said.strip()


def test_commands_are_verbs_of_the_program_and_targets_of_make() -> None:
    """Every command line shown begins with something that exists."""
    from typer.main import get_command

    from prensa.cli import app

    verbs = set(getattr(get_command(app), "commands"))  # noqa: B009  (typer's type does not say that it is a group)
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    known = {"prensa": verbs, "make": targets}
    shown = set()
    for path in PAGES:
        for language, text, _ in blocks(path):
            if language == "console":
                lines = [line.split() for line in text.splitlines() if line.startswith("$ ")]
                for _, program, word, *_ in lines:
                    if program in known:
                        assert word in known[program], f"{name_of(path)}: {program} {word}"
                        shown.add((program, word))
                    else:
                        assert (ROOT / word).exists(), f"{name_of(path)}: {program} {word}"
    assert {("prensa", v) for v in verbs} <= shown, "a verb that no page shows"


# ------------------------------------------------------------------------------------------------------------ reference
def generator(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reference_is_up_to_date() -> None:
    """``guide/reference.md`` is what its script writes now; if not, run ``python docs/make_reference.py``."""
    made = generator("make_reference")
    assert made.PAGE.read_text(encoding="utf-8") == made.page()


def test_the_picture_of_the_layers_is_up_to_date() -> None:
    """The arrows that the picture says it shows are those of the imports; if not, run ``python docs/make_layers.py``."""
    made = generator("make_layers")
    assert f"<dc:description>{made.description()}</dc:description>" in made.PICTURE.read_text(encoding="utf-8")


def test_the_reference_has_every_class() -> None:
    """No class of the vocabulary is missing from the page."""
    made = generator("make_reference")
    described = {c for classes in made.SECTIONS.values() for c in classes} | {vocabulary.Case}
    known = {
        c
        for name, c in vars(vocabulary).items()
        if isinstance(c, type) and dataclasses.is_dataclass(c)
        if c.__module__ == vocabulary.__name__ or name in vocabulary.__all__
    }
    known = {c for c in known | {c for _, c in public()} if getattr(c, "offered", True)}  # others are not of a file yet
    assert known == described


def test_settings_have_the_defaults_that_the_guide_says() -> None:
    """The table of settings in the guide lists every setting, with its default."""
    text = (DOCS / "guide" / "convergence.md").read_text(encoding="utf-8")
    settings = text[text.index("## Settings") :]
    rows = [[c.strip() for c in line.split("|")[1:3]] for line in settings.splitlines() if line.startswith("| `")]
    said = {key: value for keys, value in rows for key in re.findall(r"`(\w+)`", keys)}
    given = dataclasses.asdict(pr.Numerics())
    assert said.keys() == given.keys()
    for key, value in given.items():
        if value is None or isinstance(value, bool | str):
            assert said[key] == str(value).lower()
        else:
            assert float(said[key]) == value


# -------------------------------------------------------------------------------------------------------------- places
@pytest.mark.parametrize("path", [pytest.param(p, id=name_of(p)) for p in PAGES])
def test_links_lead_somewhere(path: Path) -> None:
    """Every link to a file or a heading of the checkout finds it."""
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(path)):
        if target.startswith(("https://", "http://")):
            continue
        file, _, anchor = target.partition("#")
        there = (path.parent / file).resolve() if file else path
        assert there.exists(), f"{name_of(path)} links to {target}"
        assert ROOT in there.parents
        if anchor:
            assert anchor in anchors(there), f"{name_of(path)} links to {target}"


def anchors(path: Path) -> set[str]:
    """Anchors of the headings of a page."""
    titles = re.findall(r"^#+ (.+)$", prose(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", t.lower()).strip().replace(" ", "-") for t in titles}


def test_every_page_can_be_reached() -> None:
    """Every page of the site is linked from its index."""
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\(([^)#]+)", index))
    for path in PAGES:
        if DOCS in path.parents and path.name not in ("index.md", "verification-table.md"):
            assert path.relative_to(DOCS).as_posix() in linked


def test_every_record_names_its_chapter() -> None:
    """Every decision record has its number, a link to the chapter of the book that has its result, and a date."""
    records = sorted(LAB.glob("[0-9]*.md"))
    assert records
    for path in records:
        title, _, chapter, _, date = path.read_text(encoding="utf-8").split("\n")[:5]
        assert title.startswith(f"# {path.name[:4]} ")
        assert chapter.startswith("Now in [chapter ") and re.fullmatch(r"\d{4}-\d\d-\d\d", date)
        for number, to in re.findall(r"\[chapter (\d+), [^]]+\]\(([^)]+)\)", chapter):
            there = path.parent / to
            assert there.is_file() and there.name.startswith(f"{int(number):02d}-"), path.name


def test_functions_that_pages_name_exist() -> None:
    """``file.py: function`` and "`function` in `file.py`" name what is there."""
    count = 0
    for path in PAGES:
        text = prose(path)
        named = re.findall(r"`([\w/]+\.py): (\w+)`", text)
        named += [(file, name) for name, file in re.findall(r"`(?:\w+\.)?(\w+)`\s+in\s+`([\w/]+\.py)`", text)]
        for file, name in named:
            assert name in defined(file), f"{name_of(path)}: {file}: {name}"
        for file in re.findall(r"`((?:\w+/)*\w+\.py)`", text):
            assert file_of(file), f"{name_of(path)}: {file}"
        count += len(named)
    assert count > 20


def file_of(name: str) -> Path | None:
    """A source file named from the root, from the package, or alone."""
    for base in (ROOT, SOURCE):
        if (base / name).is_file():
            return base / name
    return next(iter(SOURCE.rglob(name)), None) if "/" not in name else None


@cache
def defined(file: str) -> set[str]:
    path = file_of(file)
    assert path is not None, f"there is no {file}"
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names |= {t.id for t in node.targets if isinstance(t, ast.Name)}
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def test_messages_that_the_guide_explains_are_said() -> None:
    """Each message of the table in "When a run stops" is in the source."""
    text = (DOCS / "guide" / "convergence.md").read_text(encoding="utf-8")
    messages = text[text.index("## When a run stops") : text.index("## Settings")]
    cells = [line.split("|")[1] for line in messages.splitlines() if line.startswith("| `")]
    said = "\n".join(literals())
    parts = [p.strip() for c in cells for message in re.findall(r"`([^`]+)`", c) for p in message.split("…")]
    assert len(parts) > 9
    for part in parts:
        assert part in said, part


def literals() -> Iterator[str]:
    """String constants of the package, pieces of formatted ones apart."""
    for path in SOURCE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value


def test_no_page_knows_the_machine_it_was_written_on() -> None:
    """No absolute path in the documentation: it would be somebody's own."""
    for path in PAGES:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            found = re.search(r"(?<![\w.:/)\]])/(?:home|root|tmp|usr|opt|var|mnt|work|Users)\b|[A-Z]:\\", line)
            assert not found, f"{name_of(path)}:{number}: {line}"
