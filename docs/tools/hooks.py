"""What MkDocs is told beyond mkdocs.yml: tutorials that run, equations as MathML, pages from the root, links without a target."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))

import equations
import tutorials

ROOT = tutorials.ROOT

#: Pages that stand in the root of the repository, by their place on the site.
FROM_ROOT = {
    "index.md": "README.md",
    "inside/architecture.md": "ARCHITECTURE.md",
    "inside/contributing.md": "CONTRIBUTING.md",
    "inside/security.md": "SECURITY.md",
    "inside/changelog.md": "CHANGELOG.md",
}

LINK = re.compile(r"(!?)\[([^\]]+)\]\(([^)\s:#]+)(#[^)]*)?\)")


def on_files(files: Files, config: Any) -> Files:
    for place, name in FROM_ROOT.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, place, content=text))
    cache = Path(config["site_dir"]).parent / "docs-cache"
    for page in tutorials.pages():
        try:
            notebook = tutorials.executed(page, cache)
        except RuntimeError as error:
            raise PluginError(str(error)) from error
        replace(files, config, page, notebook)
    return files


def replace(files: Files, config: Any, page: Path, notebook: dict[str, Any]) -> None:
    """Puts a tutorial that has run in the place of its source, with its figures and its notebook."""
    import json

    place = f"tutorials/{page.name}"
    text, figures = tutorials.as_page(notebook, page.stem)
    text += f"\n[This page as a notebook]({page.stem}.ipynb){{ download }}\n"
    files.remove(files.src_uris[place])
    files.append(File.generated(config, place, content=text))
    files.append(File.generated(config, f"tutorials/{page.stem}.ipynb", content=json.dumps(notebook, indent=1)))
    for name, content in figures.items():
        found = tutorials.figure_bytes(name, content)
        files.append(File.generated(config, f"tutorials/figures/{name}", content=found))


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    place = page.file.src_uri
    if place == "theory.md":
        markdown = equations.rendered(markdown)
    return relinked(markdown, place, files)


def relinked(markdown: str, place: str, files: Files) -> str:
    """Links of the repository as links of the site; a link to what the site does not have becomes its words."""
    own = FROM_ROOT.get(place)
    folder = ROOT if own else (ROOT / "docs" / place).parent
    shown = {ROOT / name: where for where, name in FROM_ROOT.items()}
    shown[ROOT / "docs" / "adr"] = "adr/index.md"

    def link(found: re.Match[str]) -> str:
        mark, words, path, anchor = found.group(1), found.group(2), found.group(3), found.group(4) or ""
        target = Path(os.path.normpath(folder / path))
        where = shown.get(target)
        if where is None and target.is_relative_to(ROOT / "docs"):
            where = target.relative_to(ROOT / "docs").as_posix()
        if where is None or Path(path).is_absolute():
            return words
        if where not in files.src_uris and own is None:
            # Left to MkDocs, which says where it is wrong.
            return found.group()
        near = os.path.relpath(where, os.path.dirname(place) or ".").replace(os.sep, "/")
        return f"{mark}[{words}]({near}{anchor})"

    parts = re.split(r"^(```.*\n(?:.*\n)*?```)$", markdown, flags=re.MULTILINE)
    return "".join(part if part.startswith("```") else LINK.sub(link, part) for part in parts)
