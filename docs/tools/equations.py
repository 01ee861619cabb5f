"""Equations in plain Unicode, as docs/theory.md has them, as MathML.

A fenced block without a language is a block of equations: a line is a row, three spaces or more part what stands in it,
and ``(4)`` at its end is its number. Browsers draw MathML by themselves, so that a page needs no script.
"""

from __future__ import annotations

import re
import unicodedata
from html import escape

SUBSCRIPTS = dict(zip("₀₁₂₃₄₅₆₇₈₉₊₋₌₍₎ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓᵦᵧᵨᵩᵪ", "0123456789+−=()aehijklmnoprstuvxβγρφχ"))
SUPERSCRIPTS = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻⁼⁽⁾ᵀᴺᴾᵃᵇᶜᵈᵉᶠᵍʰⁱʲᵏˡᵐⁿᵒᵖʳˢᵗᵘᵛʷˣʸᶻ", "0123456789+−=()TNPabcdefghijklmnoprstuvwxyz"))
#: What stands over a letter. Dots and bars are not those of MathML's accents, which fonts without mathematics draw into the letter.
ACCENTS = {"\u0307": ".", "\u0308": "..", "\u0302": "^", "\u0303": "~", "\u0304": "–"}
PAIRS = {"(": ")", "[": "]", "{": "}"}
RELATIONS = "=←≈≤≥∝∋"
NUMBER = re.compile(r"\((\d+[a-z]?)\)$")
#: Runs of letters that are a product or a differential; other runs are words.
PRODUCTS = frozenset("dt dq dL dH dE dQ dF dp ds dr dθ kh qq jk".split())
#: Words that need no space around them.
FUNCTIONS = frozenset(
    "sin cos tan exp log det tr diag arg argmin max min sat sgn cosh tanh arcsin artanh arsinh ln mod rms".split()
)


def element(tag: str, *children: str) -> str:
    return f"<{tag}>{''.join(children)}</{tag}>"


def row(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else element("mrow", *parts)


class Line:
    """A reader of one expression, from left to right."""

    def __init__(self, text: str) -> None:
        self.text = unicodedata.normalize("NFD", text)
        self.at = 0

    def peek(self) -> str:
        return self.text[self.at : self.at + 1]

    def take(self) -> str:
        self.at += 1
        return self.text[self.at - 1]

    def until(self, close: str = "") -> list[str]:
        """The atoms up to a closing bracket, or to the end."""
        parts = []
        while self.peek() and self.peek() != close:
            parts.append(self.scripted())
        self.at += 1
        return parts or [element("mrow")]

    def scripted(self) -> str:
        """An atom with its primes, sub- and superscripts."""
        base = self.atom()
        below, above = [], []
        while True:
            if self.peek() in SUBSCRIPTS and self.peek():
                below.append(plain(self.run(SUBSCRIPTS)))
            elif self.peek() in SUPERSCRIPTS and self.peek():
                above.append(plain(self.run(SUPERSCRIPTS)))
            elif self.peek() and self.peek() in "′″‴*":
                above.append(element("mo", self.take()))
            elif self.peek() and self.peek() in "_^" and self.text[self.at + 1 : self.at + 2].strip():
                (below if self.take() == "_" else above).append(self.argument())
            else:
                break
        if below and above:
            return element("msubsup", base, row(below), row(above))
        if below or above:
            return element("msub" if below else "msup", base, row(below or above))
        return base

    def run(self, table: dict[str, str]) -> str:
        found = ""
        while self.peek() and self.peek() in table:
            found += table[self.take()]
        return found

    def argument(self) -> str:
        """What follows ``_`` or ``^``: a group in brackets, or a run of letters."""
        if self.peek() in PAIRS and self.peek():
            bracket = self.take()
            inner = row(self.until(PAIRS[bracket]))
            return inner if bracket == "{" else element("mrow", "<mo>(</mo>", inner, "<mo>)</mo>")
        found = re.compile(r"[^\W_]+[\u0300-\u036f]*").match(self.text, self.at)
        if found is None:
            return plain(self.take())
        letters = "".join(c for c in found.group() if c not in SUBSCRIPTS and c not in SUPERSCRIPTS)
        self.at += len(letters)
        return plain(letters)

    def atom(self) -> str:
        character = self.peek()
        if character == " ":
            spaces = re.compile(" +").match(self.text, self.at)
            self.at = spaces.end() if spaces else self.at + 1
            width = 0.12 if spaces and len(spaces.group()) == 1 else 1.0
            return f'<mspace width="{width}em"/>'
        if character == "√":
            self.take()
            if self.peek() == "(":
                self.take()
                return element("msqrt", *self.until(")"))
            return element("msqrt", self.scripted())
        if character.isdigit():
            found = re.compile(r"\d+(\.\d+)?").match(self.text, self.at)
            self.at = found.end() if found else self.at + 1
            return element("mn", found.group() if found else character)
        if character.isalpha():
            return self.letters()
        if character in "½¼¾":
            return element("mn", self.take())
        kind = ' stretchy="false"' if character in "()[]{}|‖⟨⟩" else ""
        return f"<mo{kind}>{escape(self.take())}</mo>"

    def letters(self) -> str:
        """A symbol, with its accent, or a word."""
        found = re.compile(r"[A-Za-z]{2,}(?![\u0300-\u036f])(-[a-z]+)*").match(self.text, self.at)
        if found and found.group() not in PRODUCTS:
            self.at = found.end()
            word = found.group()
            return element("mtext", word if word in FUNCTIONS else f"\u00a0{word}\u00a0")
        symbol = element("mi", self.take())
        while self.peek() and unicodedata.combining(self.peek()):
            accent = ACCENTS.get(self.take(), "–")
            shape = ' accent="true"' if accent in "^~" else ""
            symbol = f'<mover{shape}>{symbol}<mo stretchy="false" lspace="0" rspace="0">{accent}</mo></mover>'
        return symbol


def plain(text: str) -> str:
    """A script without scripts of its own."""
    if text.isdigit():
        return element("mn", text)
    if len(text) > 2 and text.isalpha():
        return element("mtext", text)
    return row([element("mi" if c.isalpha() else "mn" if c.isdigit() else "mo", escape(c)) for c in text])


def mathml(text: str) -> str:
    """An expression as MathML."""
    return f'<math display="inline" displaystyle="true">{"".join(Line(text.strip()).until())}</math>'


def relation(text: str) -> int:
    """Where the first relation outside of brackets stands, else the end."""
    depth = 0
    for at, character in enumerate(text):
        depth += (character in "([{") - (character in ")]}")
        if depth == 0 and character in RELATIONS and text[at - 1 : at] == " ":
            return at
    return len(text)


def is_prose(text: str) -> bool:
    return len(re.findall(r"\b[a-z]{3,}\b", text)) > 1 and not re.search(rf"[{RELATIONS}²/∂Σ√π]", text)


def cells(line: str) -> tuple[list[str], str]:
    """What stands in the columns of a line, and its number."""
    parts = [part for part in re.split(r" {3,}", line.strip()) if part]
    number = NUMBER.search(parts[-1]) if parts else None
    if number and parts[-1] == number.group():
        parts.pop()
    elif number and re.search(r"  \(\d+[a-z]?\)$", line):
        parts[-1] = parts[-1][: number.start()].rstrip()
    else:
        number = None
    if not parts:
        return [], number.group(1) if number else ""
    at = 0 if line.startswith("  ") else relation(parts[0])
    first = [parts[0][:at].strip(), parts[0][at:].strip()] if at < len(parts[0]) else [parts[0], ""]
    return first + parts[1:], number.group(1) if number else ""


def cell(text: str, place: int) -> str:
    side = ' class="left"' if place == 0 else ""
    content = "" if not text else escape(text) if is_prose(text) else mathml(text)
    return f"<td{side}>{content}</td>"


def table(block: str) -> str:
    """A block of equations as a table of HTML, whose rows have the numbers as anchors."""
    rows = [cells(line) for line in block.split("\n") if line.strip()]
    alone = all(len(parts) < 2 or not parts[1] for parts, _ in rows)
    width = max((len(parts) for parts, _ in rows), default=0)
    lines = []
    for parts, number in rows:
        found = [cell(text, 1 if alone else k) for k, text in enumerate(parts)]
        found += ["<td></td>"] * (width - len(parts))
        name = f' id="eq-{number}"' if number else ""
        shown = f'<a href="#eq-{number}">({number})</a>' if number else ""
        lines.append(f'<tr{name}>{"".join(found)}<td class="number">{shown}</td></tr>')
    return f'<div class="equations"><table class="rows">{"".join(lines)}</table></div>'


def rendered(markdown: str) -> str:
    """A page whose blocks of equations are MathML, and whose mentions of their numbers are links."""
    parts = re.split(r"^(```.*\n(?:.*\n)*?```)$", markdown, flags=re.MULTILINE)
    numbers = set()
    for k, part in enumerate(parts):
        if part.startswith("```\n"):
            parts[k] = table(part[4:-3])
            numbers |= set(re.findall(r'id="eq-(\w+)"', parts[k]))

    def link(found: re.Match[str]) -> str:
        number = found.group(1)
        return f"[({number})](#eq-{number})" if number in numbers else found.group()

    for k, part in enumerate(parts):
        if not part.startswith(("```", "<div")):
            parts[k] = re.sub(r"(?<![\w`\]])\((\d+[a-z]?)\)(?!\()", link, part)
    return "".join(parts)
