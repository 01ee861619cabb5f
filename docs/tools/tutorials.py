"""Runs the tutorials: a page of Markdown with Python cells becomes a page with their outputs, and a notebook.

A cell is a fenced block ``python``; one that is marked ``python tags=["check"]`` runs too, but is not shown: it asserts what
the text says. With LAGRANGIAN_QUICK=1 fits are shorter. What has run is kept in a folder by the hash of the page and of the
package, so that nothing runs twice.

    python docs/tools/tutorials.py FOLDER [PAGE …]     runs pages and writes FOLDER/PAGE.ipynb
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
import sys
import time
from pathlib import Path
from typing import Any

TOOLS = Path(__file__).parent
ROOT = TOOLS.parents[1]
TUTORIALS = ROOT / "docs" / "tutorials"
PACKAGE = ROOT / "python" / "lagrangian"

#: The longest that one cell may take, s.
LONGEST = 600

#: Runs before the first cell: figures are drawings whose text and axes suit a light and a dark page.
BEFORE = "%config InlineBackend.figure_formats = ['svg']"


def pages() -> list[Path]:
    """The pages that have cells."""
    return [page for page in sorted(TUTORIALS.glob("*.md")) if "\n```python" in page.read_text(encoding="utf-8")]


def is_quick() -> bool:
    return os.environ.get("LAGRANGIAN_QUICK", "") not in ("", "0")


def state_of(page: Path) -> str:
    """The hash of all that a run depends on."""
    found = hashlib.sha256()
    tools = [TOOLS / "tutorials.py", TOOLS / "matplotlibrc"]
    code = sorted(PACKAGE.glob("*.py")) + sorted(PACKAGE.glob("_lagrangian*.so"))
    text = page.read_text(encoding="utf-8")
    beside = [file for file in sorted(TUTORIALS.glob("*.[jp]*")) if file.name in text]
    for file in [page, *tools, *code, *beside]:
        found.update(file.name.encode() + b"\0" + file.read_bytes())
    found.update(f"quick={is_quick()}".encode())
    return found.hexdigest()[:24]


def executed(page: Path, cache: Path) -> dict[str, Any]:
    """The notebook of a page with its outputs, run now or taken from the cache."""
    import nbformat

    kept = cache / f"{page.stem}-{state_of(page)}.ipynb"
    if not kept.exists():
        start = time.monotonic()
        notebook = run(page)
        cache.mkdir(parents=True, exist_ok=True)
        for old in cache.glob(f"{page.stem}-{'?' * 24}.ipynb"):
            old.unlink()
        kept.write_text(nbformat.writes(notebook), encoding="utf-8")
        print(f"tutorials: {page.stem} ran in {time.monotonic() - start:.0f} s", file=sys.stderr)
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
    return found


def run(page: Path) -> Any:
    """Runs the cells of a page in a kernel of this interpreter, in an empty folder."""
    import tempfile

    import jupytext
    import nbformat
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError

    notebook = jupytext.read(page, fmt="md")
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook.cells.insert(0, nbformat.v4.new_code_cell(BEFORE))
    os.environ["MATPLOTLIBRC"] = str(TOOLS / "matplotlibrc")
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT / "python"), str(TUTORIALS)])
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook,
            timeout=LONGEST,
            resources={"metadata": {"path": folder}},
            extra_arguments=["--log-level=40"],
        )
        try:
            client.execute()
        except CellExecutionError as error:
            raise RuntimeError(f"a cell of {page.relative_to(ROOT)} failed: {error}") from error
    del notebook.cells[0]
    return notebook


def as_page(notebook: dict[str, Any], name: str) -> tuple[str, dict[str, str]]:
    """The Markdown of a page with outputs, and its figures by the names of their files."""
    parts: list[str] = []
    figures: dict[str, str] = {}
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        if "check" in cell["metadata"].get("tags", []):
            continue
        parts.append(f"```python\n{source}\n```")
        parts += [shown(output, name, figures) for output in joined(cell["outputs"])]
    return "\n\n".join(part for part in parts if part) + "\n", figures


def joined(outputs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Successive pieces of one stream as one output."""
    found: list[dict[str, Any]] = []
    for output in outputs:
        if output["output_type"] == "stream" and found and found[-1].get("name") == output["name"]:
            found[-1] = {**output, "text": ["".join(found[-1]["text"]), "".join(output["text"])]}
        else:
            found.append(output)
    return found


def shown(output: dict[str, Any], name: str, figures: dict[str, str]) -> str:
    """An output as Markdown; progress on standard error is left out."""
    if output["output_type"] == "stream":
        return block("".join(output["text"])) if output["name"] == "stdout" else ""
    data = output.get("data", {})
    for kind in ("image/svg+xml", "image/png"):
        if kind in data:
            file = f"{name}-{len(figures) + 1}.{'svg' if 'svg' in kind else 'png'}"
            figures[file] = "".join(data[kind])
            return f'<div class="output figure" markdown>\n![Figure {len(figures)}](figures/{file})\n</div>'
    if "text/html" in data:
        table = re.sub(r"\n\s*", "", re.sub(r"<style.*?</style>", "", "".join(data["text/html"]), flags=re.DOTALL))
        return f'<div class="output">{table}</div>'
    return block("".join(data.get("text/plain", "")))


def block(text: str) -> str:
    """Text as a block that does not wrap."""
    return f'<div class="output" markdown>\n\n```text\n{text.rstrip()}\n```\n\n</div>' if text.strip() else ""


def figure_bytes(file: str, content: str) -> bytes:
    return base64.b64decode(content) if file.endswith(".png") else content.encode()


def main(arguments: list[str]) -> int:
    if not arguments:
        print("usage: python docs/tools/tutorials.py FOLDER [PAGE …]", file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    chosen = [page for page in pages() if not arguments[1:] or page.stem in arguments[1:]]
    if not chosen:
        print(f"tutorials: no page is named {' or '.join(arguments[1:])}", file=sys.stderr)
        return 2
    folder.mkdir(parents=True, exist_ok=True)
    for page in chosen:
        notebook = executed(page, folder / "cache")
        (folder / f"{page.stem}.ipynb").write_text(json.dumps(notebook, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
