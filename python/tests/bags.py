"""Bags of ROS 2 as ``rosbags`` writes them, for the tests and for the examples of the documents.

``python bags.py log.csv bag.db3`` writes the first trajectory of a table as the joint states of a bag, also as ``.mcap``.
"""

from __future__ import annotations

import csv
import math
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

KIND, TOPIC = "sensor_msgs/msg/JointState", "/joint_states"
STORE = get_typestore(Stores.ROS2_HUMBLE)
# When the bags begin, ns.
START = 1_763_000_000_000_000_000


@dataclass(frozen=True)
class State:
    """A joint state before it is written; times in ns."""

    names: Sequence[str]
    position: Sequence[float]
    velocity: Sequence[float] = ()
    effort: Sequence[float] = ()
    stamp: int = START
    topic: str = TOPIC
    received: int = field(default=0)

    def bytes(self) -> bytes:
        types = STORE.types
        time = types["builtin_interfaces/msg/Time"](self.stamp // 10**9, self.stamp % 10**9)
        header = types["std_msgs/msg/Header"](time, "base")
        numbers = [np.array(own, dtype=np.float64) for own in (self.position, self.velocity, self.effort)]
        return bytes(STORE.serialize_cdr(types[KIND](header, list(self.names), *numbers), KIND))


def state(k: int) -> State:
    """Message ``k`` of two joints at 100 Hz."""
    stamp = START + k * 10_000_000
    return State(
        ("shoulder", "elbow"),
        (math.sin(k), math.cos(k)),
        (0.1 * k, -0.1 * k),
        (1.0 / (1.0 + k), -float(k)),
        stamp,
        received=stamp + 7,
    )


def states(count: int, change: Callable[[int, State], State] = lambda _, own: own) -> list[State]:
    return [change(k, state(k)) for k in range(count)]


def write(path: Path, messages: Iterable[State], *, compressed: bool = False, others: Sequence[tuple[str, str]] = ()) -> Path:
    """Writes one file of a bag; ``others`` are topics without messages, with their types."""
    storage = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    with tempfile.TemporaryDirectory() as folder:
        writer = Writer(Path(folder) / "bag", version=9, storage_plugin=storage)
        if compressed:
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            topics: dict[str, Any] = {}
            for topic, kind in others:
                writer.add_connection(topic, kind, typestore=STORE)
            for own in messages:
                if own.topic not in topics:
                    topics[own.topic] = writer.add_connection(own.topic, KIND, typestore=STORE)
                writer.write(topics[own.topic], own.received or own.stamp, own.bytes())
        shutil.move(Path(folder) / "bag" / f"bag{path.suffix}", path)
    return path


def main(table: str, bag: str) -> None:
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    rows = [row for row in rows if row.get("trajectory") == rows[0].get("trajectory")]
    own = [
        replace(state(0), stamp=START + round(float(row["t"]) * 1e9), **{
            name: [float(row[f"{signal}{k}"]) for k in (1, 2)]
            for name, signal in (("position", "q"), ("velocity", "qd"), ("effort", "tau"))
        })
        for row in rows
    ]
    write(Path(bag), [replace(one, received=one.stamp) for one in own])


if __name__ == "__main__":
    main(*sys.argv[1:])
