"""Texts of files in messages."""

from __future__ import annotations


def shortened(text: str) -> str:
    """A name in the form of messages: one line of at most 60 characters, none of them hidden."""
    short = text if len(text) <= 60 else text[:60] + "…"
    return "".join(own if own.isprintable() else f"\\u{{{ord(own):x}}}" for own in short)
