"""Doctests in docstrings of the package as sections of examples, for the reference."""

from __future__ import annotations

import re
from typing import Any

import griffe

BLOCK = re.compile(r"(?:^>>> .*\n?)(?:^.*\S.*\n?)*", re.MULTILINE)


class Doctests(griffe.Extension):
    """Marks each block that begins with ``>>>`` as an example, and drops the colons of a literal block."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring is None:
            return
        text = obj.docstring.value
        text = BLOCK.sub(lambda found: "Examples:\n" + indented(found.group()), text)
        obj.docstring.value = text.replace("::\n", ":\n")


def indented(block: str) -> str:
    return "".join(f"    {line}\n" for line in block.rstrip().split("\n"))
