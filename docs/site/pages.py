"""Pages of the site that stand elsewhere in the repository, links to them, the API reference, and the table of contents.

A hook of MkDocs. The Markdown files are written to be read in the repository: what lies outside ``docs`` gets a place in the
site, and each relative link is turned to where its target is there. A link whose target does not exist is an error.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path, PurePosixPath
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "results" / "verification-table.md"
OUTSIDE = (
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "SECURITY.md",
    "LICENSE",
    "examples/*",
    "benchmarks/*.md",
    "examples/*/*",
)
LINK = re.compile(r"(?<=\])\((?P<to>[^)\s:#]+)(?P<anchor>#[^)\s]*)?\)")
SHOWN = {".yaml": "yaml", ".py": "python", ".inp": "text", ".csv": "text", "": "text"}
MENU = (
    ("Guide", "guide"),
    ("Tutorials", "tutorials"),
    ("Gallery", "gallery"),
    ("Theory", "theory"),
    ("Developers", "developer"),
    ("Book", "developer/book"),
)
GROUPS = {
    "Running and results": (
        "load", "dump", "solve", "run", "resume", "results", "ProgressBar", "discretise", "evaluate", "particles",
    ),
    "Problem and steps": ("Problem", "Units", "Start", "Step", "Until", "ToolForce", "ToolTravel", "Case", "Numerics", "Output"),
    "Bodies and meshes": (
        "Body", "Rectangle", "Grade", "Strip", "Wire", "Nose", "Disc", "Annulus", "Patch", "ArcSide", "SplineSide", "Points",
        "File", "Outline", "Tie", "Interference", "Remesh", "Sizes", "When",
    ),
    "Three dimensions": ("Box", "Cylinder", "Extrusion", "Revolution", "Bricks", "Tetrahedra"),
    "Contacts, supports, loads": (
        "Contact", "NoContact", "BodyContact", "Fixed", "Motion", "Crank", "Feed", "Push", "Load", "Springs", "Press",
    ),
    "Dies and wear": ("Die", "ShrinkRing", "die_stress", "tool_loads", "wear"),
    "Heat": ("Heat", "Conductor"),
    "Sweeps, gradients, calibration": ("sweep", "converge", "gradient", "calibrate", "identify", "Observe", "Test"),
    "Errors": ("PrensaError", "CaseError", "SolveError"),
    "Your own laws": (
        "FlowCurve", "FrictionLaw", "Enforcement", "ToolShape", "IsotropicMaterial", "Material", "DamageLaw", "WearLaw",
        "PointCurve", "PointMaterial",
    ),
}  # fmt: skip
LAWS = {"friction": "Friction laws", "enforcement": "Enforcement of contact", "tool": "Tools", "flow": "Flow curves",
        "damage": "Damage laws", "wear": "Wear laws", "material": "Materials"}  # fmt: skip
LISTED = re.compile(r"^- \[.+$|^\[.+$", re.MULTILINE)  # of the first page: its lists, not what it shows
SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
GALLERY = "gallery/forming.md"
COMPARED = re.compile(
    r"^## (?P<title>.+)\n\n(?P<what>.+?) \[`[^`]+`\]\([^)]+\)\n\n!\[[^]]*\]\((?P<picture>[^)]+)\)", re.MULTILINE
)


def inside(path: Path) -> str:
    """Where a file of the repository stands in the site, as a source path there."""
    where = path.relative_to(ROOT)
    if where.parts[0] == "docs":
        return PurePosixPath(*where.parts[1:]).as_posix()
    if where.name == "README.md":
        return "project/README.md" if len(where.parts) == 1 else (where.parent / "index.md").as_posix()
    if len(where.parts) == 1:
        return f"project/{where.name}"
    return where.as_posix() + (".md" if where.suffix in SHOWN else "")


def outside() -> list[Path]:
    """Files outside ``docs`` that are pages, pictures or listings of the site."""
    found = sorted({p for pattern in OUTSIDE for p in ROOT.glob(pattern) if p.is_file()})
    return [p for p in found if p.suffix in {".md", ".png", ".svg", *SHOWN}]


def turned(text: str, source: Path) -> str:
    """Text with its relative links turned to where their targets are in the site."""
    here = PurePosixPath(inside(source)).parent

    def there(found: re.Match[str]) -> str:
        target = (source.parent / found["to"]).resolve()
        if target.is_dir():
            target = target / "README.md"
        if not target.exists() or ROOT not in target.parents:
            raise PluginError(f"{source.relative_to(ROOT)}: the link to {found['to']!r} leads nowhere")
        to = os.path.relpath(inside(target), here).replace(os.sep, "/")
        return f"({to}{found['anchor'] or ''})"

    return LINK.sub(there, text)


def topics() -> dict[str, list[str]]:
    """Every public name of the package by its topic; laws by the kind that they are of."""
    sys.path.insert(0, str(ROOT / "src"))
    import prensa
    from prensa.registry import DOORS, public

    known = set(dir(prensa)) - {"__version__"}
    made = {title: [n for n in names if n in known] for title, names in GROUPS.items()}
    for kind, door in DOORS.items():
        if not door.named:
            made[LAWS.get(kind, f"Laws: {door}")] = sorted({name for name, _ in public(kind)} & known)
    rest = sorted(known - {n for names in made.values() for n in names})
    return {title: names for title, names in (made | {"More": rest}).items() if names}


def api() -> dict[str, str]:
    """The pages of the API: one a topic, and a first one that lists them with their names."""
    import prensa

    made, rows = {}, ["# Python API", "", "Every name of `import prensa as pr`, from its docstring.", ""]
    for title, names in topics().items():
        page = re.sub(r"[^a-z]+", "-", title.lower()).strip("-") + ".md"
        lines = [f"# {title}", ""]
        for name in names:
            value: Any = getattr(prensa, name)
            lines += [f"::: {value.__module__}.{value.__qualname__}", ""]
        made[f"api/{page}"] = "\n".join(lines)
        rows.append(f"- [{title}]({page}): " + ", ".join(f"`{name}`" for name in names))
    return {"api/index.md": "\n".join([*rows, ""]), **made}


def cards(text: str) -> str:
    """The gallery with a card a process before its comparisons: picture, title and sentence, which lead to the section."""
    from markdown.extensions.toc import slugify

    made = ['<div class="grid cards pictures" markdown>', ""]
    for found in COMPARED.finditer(text):
        to = f"#{slugify(found['title'], '-')}"
        made += [f"- [![{found['title']}]({found['picture']})]({to})", "", f"    **[{found['title']}]({to})**", "",
                 f"    {found['what']}", ""]  # fmt: skip
    first = SECTION.search(text)
    assert first is not None, f"{GALLERY} has no sections"
    return text[: first.start()] + "\n".join([*made, "</div>", "", ""]) + text[first.start() :]


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what stands outside ``docs``, and the API."""
    for path in outside():
        where = inside(path)
        if path.suffix == ".md":
            files.append(File.generated(config, where, content=path.read_text(encoding="utf-8")))
        elif path.suffix in SHOWN:
            hidden = "---\nsearch: {exclude: true}\n---\n\n" if path.suffix == ".csv" else ""  # numbers: nobody looks for them
            listing = f"{hidden}# {path.name}\n\n```{SHOWN[path.suffix]}\n{path.read_text(encoding='utf-8')}\n```\n"
            files.append(File.generated(config, where, content=listing))
        else:
            files.append(File.generated(config, where, abs_src_path=str(path)))
    for where, text in api().items():
        files.append(File.generated(config, where, content=text))
    if TABLE.exists():
        files.append(File.generated(config, TABLE.name, content=TABLE.read_text(encoding="utf-8")))
    config.nav = menu(files)
    return files


def menu(files: Files) -> list[Any]:
    """The table of contents: pages in the order in which docs/index.md lists them, those of the guide under its headings."""
    index = turned((ROOT / "docs" / "index.md").read_text(encoding="utf-8"), ROOT / "docs" / "index.md")
    sections = dict(zip(["", *SECTION.findall(index)], SECTION.split(index)[::2], strict=True))
    named = {title: [m["to"] for line in LISTED.findall(text) for m in LINK.finditer(line)] for title, text in sections.items()}
    pages = {f.src_uri for f in files.documentation_pages()}
    chapters: list[Any] = [{"Home": "index.md"}]
    for title, folder in MENU:
        left = {p for p in pages if menu_folder(p) == folder}
        own: list[Any] = []
        for heading, links in named.items():
            here = [p for p in dict.fromkeys(links) if p in left and heading]
            left -= set(here)
            own += [{heading: here}] if folder == "guide" and here else here
        own += sorted(left)
        if own:
            chapters.append({title: own})
    chapters.append({"Examples": ["examples/index.md", *sorted(p for p in pages if re.fullmatch("examples/(?!index).*", p))]})
    chapters.append({"API": [p for p in api() if p in pages]})
    checked = [p for p in ("verification.md", TABLE.name, *sorted(p for p in pages if p.startswith("benchmarks/"))) if p in pages]
    chapters.append({"Accuracy and speed": checked})
    chapters.append({"Project": sorted(p for p in pages if p.startswith("project/"))})
    return chapters


def menu_folder(page: str) -> str:
    """The deepest folder of the menu that holds a page; '' if none does."""
    return max((folder for _, folder in MENU if page.startswith(folder + "/")), key=len, default="")


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn the links of a page; listings have none."""
    where = page.file.src_uri
    for path in outside():
        if inside(path) == where:
            return turned(markdown, path) if path.suffix == ".md" else markdown
    if where == TABLE.name or where.startswith("api/"):
        return markdown
    made = turned(markdown, ROOT / "docs" / where)
    return cards(made) if where == GALLERY else made
