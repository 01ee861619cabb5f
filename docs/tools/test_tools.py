"""Tests of what the site is made with: `python -m unittest discover -s docs/tools`."""

import re
import unittest
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


if __name__ == "__main__":
    unittest.main()
