"""Tables in Parquet files, read and written by ``pyarrow``: numbers, lists of numbers, and names of trajectories."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from ._text import shortened
from .errors import DataError, MissingExtra

if TYPE_CHECKING:
    from ._lagrangian import Asked

# Number of rows that are read at a time, largest number of numbers in a list, and of bytes in the name of a trajectory.
BATCH, WIDEST, LONGEST = 1 << 13, 1 << 12, 1 << 10
# Largest number of entries of a list in the footer: of columns, which bounds how deep they are nested, and of groups of rows.
MOST_ENTRIES = 1 << 12
# The columns may take this many bytes, or this many times those of the file, where that is more.
UNPACKED, PACKING = 1 << 30, 100
# How a file is opened: checksums of pages are compared, and no more is held than a column in a group of rows, as it is in the file.
OPTIONS = {
    "page_checksum_verification": True,
    "pre_buffer": False,
    "thrift_container_size_limit": MOST_ENTRIES,
}


def read(path: Path, file: IO[bytes], asked: Asked) -> dict[str, Any]:
    """Writes the columns that are asked for into an NPZ file, one after another, a batch of rows at a time; nulls become NaN.

    Other columns are arrays without rows, so that their names are known.
    """
    try:
        from pyarrow.parquet import ParquetFile
    except ImportError as error:
        raise MissingExtra("Parquet files are read by pyarrow: pip install 'lagrangian[parquet]'") from error
    with _damaged(lambda: ParquetFile(path, **OPTIONS)) as table:
        columns = [_Column(table, field, asked) for field in table.schema_arrow]
        used = asked.used([(own.name, own.width) for own in columns])
        for own in (columns[k] for k in used):
            own.use(table.metadata.num_rows)
        most = max(UNPACKED, PACKING * path.stat().st_size)
        if (size := sum(own.rows * own.kind.itemsize * (own.width or 1) for own in columns)) > most:
            raise DataError(f"its columns take {size} bytes, more than {most}: the file is damaged, or is not a motion")
        with zipfile.ZipFile(file, "w") as archive:
            for own in columns:
                with archive.open(f"{own.name}.npy", "w", force_zip64=True) as entry:
                    own.write(entry)
    return {}


def written(table: IO[bytes]) -> bytes:
    """A Parquet file of the arrays of an NPZ file, with a column for each column of an array."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise MissingExtra("Parquet files are written by pyarrow: pip install 'lagrangian[parquet]'") from error
    columns: dict[str, Any] = {}
    for name, array in np.load(table).items():
        single = {name: array} if array.ndim == 1 else {f"{name}{k + 1}": own for k, own in enumerate(array.T)}
        columns |= {name: pyarrow.array(np.ascontiguousarray(own)) for name, own in single.items()}
    schema = pyarrow.schema([pyarrow.field(name, own.type, nullable=False) for name, own in columns.items()])
    file = io.BytesIO()
    parquet.write_table(pyarrow.table(columns, schema), file)
    return file.getvalue()


class _Column:
    """A column of a file.

    Attributes:
        name: Its name.
        width: Of lists that are asked for, the number of numbers in each: that of the first.
        rows: The number of rows that are written, 0 until it is used.
        kind: The type of its values.
    """

    def __init__(self, table: Any, field: Any, asked: Asked) -> None:
        from pyarrow import types

        self._table, self._type, self.name = table, field.type, str(field.name)
        self.rows, self.kind, self.width = 0, np.dtype("<f8"), None
        is_list = types.is_list(self._type) or types.is_large_list(self._type) or types.is_fixed_size_list(self._type)
        self._numbers = _is_numeric(self._type.value_type if is_list else self._type)
        if is_list and self._numbers and asked.asks_for(self.name):
            first = next(self._batches(1), None)
            self.width = None if first is None else len(first[0].as_py() or ())
            if self.width is not None and not 1 <= self.width <= WIDEST:
                raise DataError(f"the first list of column '{shortened(self.name)}' has {self.width} numbers, not 1 to {WIDEST}")
        self._numbers &= is_list is (self.width is not None)

    def use(self, rows: int) -> None:
        """Has all rows written; names take as many bytes as the longest."""
        self.rows = rows
        if self._numbers:
            return
        if not _is_text(self._type):
            raise DataError(f"column '{shortened(self.name)}' holds values of type {self._type}: store float64")
        import pyarrow.compute as compute

        lengths = (compute.max(compute.binary_length(_text(batch))).as_py() for batch in self._batches(BATCH))
        longest = max(lengths, default=0)
        if longest > LONGEST:
            raise DataError(f"a text of column '{shortened(self.name)}' has {longest} bytes, more than {LONGEST}")
        self.kind = np.dtype(f"S{max(longest, 1)}")

    def write(self, entry: IO[bytes]) -> None:
        """Writes it as a NumPy array."""
        shape = (self.rows,) if self.width is None else (self.rows, self.width)
        header = {"descr": self.kind.str, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(entry, header)
        for batch in self._batches(BATCH) if self.rows else ():
            entry.write(self._values(batch).tobytes())

    def _values(self, batch: Any) -> Any:
        if not self._numbers:
            coded = _text(batch).dictionary_encode()
            return np.array([word.encode() for word in coded.dictionary.to_pylist()], self.kind)[coded.indices.to_numpy()]
        if self.width is None:
            return batch.to_numpy(zero_copy_only=False).astype(self.kind)
        import pyarrow.compute as compute

        lengths = compute.list_value_length(batch).fill_null(self.width).to_numpy()
        if (lengths != self.width).any():
            other = lengths[lengths != self.width][0]
            raise DataError(f"a list of column '{shortened(self.name)}' has {other} numbers, the first has {self.width}")
        values = np.full((len(batch), self.width), np.nan)
        values[batch.is_valid().to_numpy(zero_copy_only=False)] = (
            batch.flatten().to_numpy(zero_copy_only=False).reshape(-1, self.width)
        )
        return values

    def _batches(self, rows: int) -> Iterator[Any]:
        """Its values, so many rows at a time."""
        batches = _damaged(lambda: self._table.iter_batches(rows, columns=[self.name], use_threads=False))
        while (batch := _damaged(lambda: next(batches, None))) is not None:
            yield batch.column(self.name)


def _is_numeric(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_integer(kind) or types.is_float32(kind) or types.is_float64(kind))


def _is_text(kind: Any) -> bool:
    from pyarrow import types

    own = kind.value_type if types.is_dictionary(kind) else kind
    return bool(types.is_string(own) or types.is_large_string(own))


def _text(batch: Any) -> Any:
    """Text without a dictionary and without nulls."""
    return batch.cast("string").fill_null("")


def _damaged(call: Any) -> Any:
    """What a call of ``pyarrow`` returns; its errors are of many kinds."""
    try:
        return call()
    except Exception as error:
        text = shortened(f"{type(error).__name__}: {error}")
        raise DataError(f"this is not a readable Parquet file ({text}): write it again") from error
