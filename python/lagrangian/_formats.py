"""Formats that are read in Python, for module and command alike: each file becomes a table, which the library reads as an NPZ file."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

from . import _bags, _parquet

if TYPE_CHECKING:
    from ._lagrangian import Asked

files = _bags.files


def read(path: Path, table: Path, asked: Asked) -> str:
    """Writes the columns of a file that are asked for into an NPZ file, ``table``.

    Returns:
        Facts in JSON: columns of signals in place of those that were named, notes, and the first message of a bag that names other
        joints.
    """
    reader = _parquet if path.suffix.lower() == ".parquet" else _bags
    with open(table, "wb") as file:
        return json.dumps(reader.read(path, file, asked))


def write(extension: str, table: bytes) -> bytes:
    """The bytes of a file from those of an NPZ file; of the formats that are read here, only Parquet is written."""
    assert extension == "parquet"
    return _parquet.written(io.BytesIO(table))
