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
    ("Guide", "guide", "Guide"),
    ("Tutorials", "tutorials", None),
    ("Gallery", "gallery", None),
    ("Theory", "theory", "Theory"),
    ("Developers", "developer", None),
    ("Book", "developer/book", None),
)
GROUPS = {
    "Solving": ("load", "dump", "solve", "run", "discretise", "evaluate", "results", "particles", "ProgressBar"),
    "Errors": ("PrensaError", "CaseError", "SolveError"),
    "Studies, gradients, calibration": ("sweep", "converge", "gradient", "calibrate", "identify", "Observe", "Test"),
    "Problem": ("Problem", "Units", "Start", "Step", "Until", "ToolForce", "ToolTravel", "Case", "Numerics", "Output"),
    "Bodies": (
        "Body", "Rectangle", "Grade", "Strip", "Wire", "Nose", "Disc", "Annulus", "Patch", "ArcSide", "SplineSide", "Points",
        "File", "Outline", "Tie", "Remesh", "Sizes", "When",
    ),
    "Contacts, supports, loads": ("Contact", "NoContact", "Fixed", "Motion", "Crank", "Feed", "Push", "Load", "Springs"),
    "To derive from": ("FlowCurve", "FrictionLaw", "Enforcement", "ToolShape", "IsotropicMaterial", "Material"),
}  # fmt: skip


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


def api() -> str:
    """The page of the API: every public name, laws by the door that they stand behind."""
    sys.path.insert(0, str(ROOT / "src"))
    import prensa
    from prensa.registry import DOORS, public

    known = set(dir(prensa)) - {"__version__"}
    laws = {kind: [name for name, _ in public(kind)] for kind, door in DOORS.items() if not door.named}
    groups: dict[str, list[str]] = {title: [n for n in names if n in known] for title, names in GROUPS.items()}
    groups |= {f"Laws: {door}": sorted(names) for door, names in laws.items()}
    rest = sorted(known - {n for names in groups.values() for n in names})
    groups["More"] = rest
    lines = ["# Python API", "", "Every name of `import prensa as pr`, from its docstring.", ""]
    for title, names in groups.items():
        if names:
            lines += [f"## {title}", ""]
        for name in names:
            value: Any = getattr(prensa, name)
            lines += [f"::: {value.__module__}.{value.__qualname__}", ""]
    return "\n".join(lines)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what stands outside ``docs``, and the API."""
    for path in outside():
        where = inside(path)
        if path.suffix == ".md":
            files.append(File.generated(config, where, content=path.read_text(encoding="utf-8")))
        elif path.suffix in SHOWN:
            listing = f"# {path.name}\n\n```{SHOWN[path.suffix]}\n{path.read_text(encoding='utf-8')}\n```\n"
            files.append(File.generated(config, where, content=listing))
        else:
            files.append(File.generated(config, where, abs_src_path=str(path)))
    files.append(File.generated(config, "api.md", content=api()))
    if TABLE.exists():
        files.append(File.generated(config, TABLE.name, content=TABLE.read_text(encoding="utf-8")))
    config.nav = menu(files)
    return files


def menu(files: Files) -> list[Any]:
    """The table of contents: chapters in the order in which docs/index.md names their pages."""
    index = turned((ROOT / "docs" / "index.md").read_text(encoding="utf-8"), ROOT / "docs" / "index.md")
    named = [m["to"] for m in LINK.finditer(index)]
    pages = {f.src_uri for f in files.documentation_pages()}
    chapters: list[Any] = [{"Start": "index.md"}]
    for title, folder, _ in MENU:
        here = {p for p in pages if menu_folder(p) == folder}
        own = [p for p in dict.fromkeys(named) if p in here]
        own += sorted(here.difference(own))
        if own:
            chapters.append({title: own})
    chapters.append({"Examples": sorted(p for p in pages if p.startswith("examples/"))})
    chapters.append({"API": "api.md"})
    checked = [p for p in ("verification.md", TABLE.name, *sorted(p for p in pages if p.startswith("benchmarks/"))) if p in pages]
    chapters.append({"How right, how fast": checked})
    chapters.append({"Project": sorted(p for p in pages if p.startswith("project/"))})
    return chapters


def menu_folder(page: str) -> str:
    """The deepest folder of the menu that holds a page; '' if none does."""
    return max((folder for _, folder, _ in MENU if page.startswith(folder + "/")), key=len, default="")


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn the links of a page; listings have none."""
    where = page.file.src_uri
    for path in outside():
        if inside(path) == where:
            return turned(markdown, path) if path.suffix == ".md" else markdown
    return markdown if where in ("api.md", TABLE.name) else turned(markdown, ROOT / "docs" / where)
