"""Tests of what the site is made with: `python -m unittest discover -s docs/tools`."""

import os
import re
import unittest
from pathlib import Path
from xml.dom import minidom

import equations
import tutorials


class Equations(unittest.TestCase):
    def test_scripts_accents_and_roots(self):
        text = equations.mathml("M⁻¹ q̈ᵢ √(a + b)")
        self.assertIn("<msup><mi>M</mi><mrow><mo>−</mo><mn>1</mn></mrow></msup>", text)
        self.assertRegex(text, r"<msub><mover><mi>q</mi><mo[^>]*>\.\.</mo></mover><mi>i</mi></msub>")
        self.assertRegex(text, r"<msqrt><mi>a</mi>.*<mi>b</mi></msqrt>")

    def test_a_number_is_an_anchor_and_its_mentions_are_links(self):
        page = equations.rendered("See (4) and (5).\n\n```\nM q̈ + c = τ ,     (4)\n```\n\n```sh\nrun (4)\n```\n")
        self.assertIn("See [(4)](#eq-4) and (5).", page)
        self.assertIn('<tr id="eq-4">', page)
        self.assertIn("run (4)", page)

    def test_every_equation_of_the_theory_is_well_formed(self):
        page = equations.rendered((tutorials.ROOT / "docs" / "theory.md").read_text(encoding="utf-8"))
        found = re.findall(r"<math.*?</math>", page)
        self.assertGreater(len(found), 300)
        for text in found:
            minidom.parseString(text)
        self.assertNotRegex(page, r"(?m)^```$\n(?!\n)")


class Tutorials(unittest.TestCase):
    def test_checks_run_and_are_not_shown(self):
        cell = {"cell_type": "code", "source": "assert True", "metadata": {"tags": ["check"]}, "outputs": []}
        said = {"output_type": "stream", "name": "stdout", "text": ["a", "b"]}
        shown = {"cell_type": "code", "source": "print()", "metadata": {}, "outputs": [said]}
        page, figures = tutorials.as_page({"cells": [cell, shown]}, "page")
        self.assertNotIn("assert", page)
        self.assertIn("```text\nab\n```", page)
        self.assertEqual(figures, {})

    def test_every_tutorial_ends_with_what_can_go_wrong_and_has_a_check(self):
        for page in tutorials.pages():
            text = page.read_text(encoding="utf-8")
            self.assertIn("## What can go wrong", text, page.name)
            self.assertIn('```python tags=["check"]', text, page.name)


class Decisions(unittest.TestCase):
    def test_each_page_has_one_line_in_the_index_and_a_number_of_its_own(self):
        folder = tutorials.ROOT / "docs" / "adr"
        pages = [page.relative_to(folder).as_posix() for page in sorted(folder.rglob("[0-9]*.md")) if page.name != "0000-template.md"]
        listed = re.findall(r"^- \[(\d{4})\]\(([^)]+)\)", (folder / "index.md").read_text(encoding="utf-8"), re.MULTILINE)
        self.assertEqual(sorted(path for _, path in listed), sorted(pages))
        self.assertEqual([number for number, _ in listed], [Path(path).name[:4] for _, path in listed])
        self.assertEqual(len({number for number, _ in listed}), len(listed))
        for path in pages:
            self.assertTrue((folder / path).read_text(encoding="utf-8").startswith(f"# {Path(path).name[:4]} "), path)

    def test_every_link_of_every_page_leads_somewhere(self):
        for page in sources(".md"):
            text = re.sub(r"^```.*?^```$|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
            for path in re.findall(r"\]\(([^)\s#]+)", text):
                if not re.match(r"[a-z]+:", path):
                    self.assertTrue((page.parent / path).exists(), f"{page}: {path}")

    def test_every_decision_that_is_mentioned_has_a_page(self):
        numbers = {page.name[:4] for page in (tutorials.ROOT / "docs" / "adr").rglob("[0-9]*.md")}
        for page in sources(".md", ".rs", ".toml", ".py", ".pyi", ".ts", ".js", ".yml"):
            text = page.read_text(encoding="utf-8")
            for number in re.findall(r"\bADR (\d+)", text):
                self.assertIn(number, numbers, page)
            for path in re.findall(r"(?<![\w/(])docs/adr/[\w./-]*\w", text):
                self.assertTrue(list(tutorials.ROOT.glob(f"{path}*")), f"{page}: {path}")


def sources(*suffixes):
    """Files of the repository with these endings, without what is built or installed."""
    for folder, inner, names in os.walk(tutorials.ROOT):
        inner[:] = [name for name in inner if name not in ("target", "node_modules", "dist", "corpus") and not name.startswith(".")]
        yield from (Path(folder) / name for name in names if name.endswith(suffixes))


if __name__ == "__main__":
    unittest.main()
