"""Joint states of ROS 2 bags, read by ``rosbags``: a row for each message of one topic, with positions as q, velocities as q̇ and
efforts as τ of the joints that are selected by name."""

from __future__ import annotations

import sqlite3
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from itertools import takewhile
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from urllib.request import pathname2url

import numpy as np

from ._data import _archive
from ._text import shortened
from .errors import DataError, MissingExtra

if TYPE_CHECKING:
    from ._lagrangian import Asked

KIND, ENCODING = "sensor_msgs/msg/JointState", "cdr"
DAMAGED = "copy it again, or record it again; `mcap recover` saves what is whole of an MCAP file that was cut"

# Largest number of joints of a topic, of topics that a message lists, and of numbers of all joint states of a bag.
MOST_JOINTS, MOST_LISTED, MOST_NUMBERS = 1000, 40, 1 << 26
# Longest chunk of an MCAP file, unpacked, bytes.
LONGEST = 1 << 28
# The file that describes a bag, its list of files, and the largest number of its characters that are read.
METADATA, LIST, MOST_TEXT = "metadata.yaml", "relative_file_paths:", 8 << 20
# A final run of omitted messages this many times as long as the longest earlier one is not a pause.
PAUSE = 10
# The signals that a bag holds.
SIGNALS = ("q", "qd", "tau")
# What the columns of velocities and efforts have after the name of the joint.
RATES = (" velocity", " effort")
TOO_MANY = f"its joint states are more than {MOST_NUMBERS} numbers: divide the bag by `ros2 bag convert`"


def read(path: Path, file: IO[bytes], asked: Asked) -> dict[str, Any]:
    """Reads one topic of a file as a table of the time, and of the positions, velocities and efforts of its joints.

    Args:
        path: A file of a bag.
        file: What becomes the table, an NPZ file.
        asked: The topic, ``None`` for the only one with joint states; columns that were named; joints that forces act on, all by default.

    Returns:
        The columns of q, qd and tau, notes, and the first message that names other joints.
    """
    topic = asked.topic
    found: dict[str, _States] = {}
    topics = _visit(path, topic, found)
    if len(found) != 1:
        raise _no_choice(topics, len(found), topic)
    [(topic, states)] = found.items()
    columns, notes = states.columns([asked.columns(signal) for signal in SIGNALS], asked.actuated)
    if others := [other for other in topics if other[0] != topic]:
        notes.append(f"topics not used: {_listed(others)}")
    used = {name for names in columns for name in names}
    needed = [name for name in states.joints if used & {name, *(name + suffix for suffix in RATES)}]
    kept = states.have(lambda names, has_positions: has_positions and names.issuperset(needed))
    messages, rows = len(kept), int(kept.sum())
    shown, named = shortened(topic), ", ".join(map(shortened, states.joints))
    if rows == 0:
        raise DataError(
            f"no message of '{shown}' has the positions of all chosen joints (topics found: {shown}, with the joints {named}): "
            "choose joints of one publisher with `q`"
        )
    if rows < messages:
        notes.append(
            f"{messages - rows} of {messages} messages of '{shown}' are omitted: they lack positions of some of the joints (all that are "
            f"named: {named}; `q` chooses)"
        )
    renamed = states.renamed(kept, needed)
    if renamed:
        renamed |= {"omitted": messages - rows, "messages": messages}
    _archive(file, states.table(kept))
    return {"columns": dict(zip(SIGNALS, columns)), "notes": notes, "renamed": renamed}


def files(folder: Path) -> list[Path]:
    """The files of a bag in the order in which they were recorded, as ROS 2 lists them: a name a line, after a dash."""
    path = folder / METADATA
    if path.exists() and not path.is_file():
        raise DataError(f"its {METADATA} is not a file")
    with open(path, encoding="utf-8", errors="replace") as file:
        lines = [line.strip() for line in file.read(MOST_TEXT).splitlines()]
    after = lines[lines.index(LIST) + 1 :] if LIST in lines else []
    names = [line[2:].strip().strip("\"'") for line in takewhile(lambda line: line.startswith("- "), after)]
    if not names:
        raise DataError(f"its {METADATA} names no file")
    for name in names:
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise DataError(
                f"its {METADATA} names '{shortened(name)}', which lies outside of it: give the file itself, if it is part of the bag"
            )
    return [folder / name for name in names]


class _States:
    """The joint states of a topic.

    Attributes:
        joints: The joints in the order of their first appearance; the first message that names some has ``first`` of them.
        times, received: Of each message, that of its header and that of its arrival, ns.
    """

    def __init__(self) -> None:
        self.joints: dict[str, int] = {}
        self.first = 0
        self.times, self.received = array("q"), array("q")
        self.stamped = False
        # Messages of the same names have the same shape: the names, whether it has positions, and three numbers for each name.
        self._shapes: dict[tuple[tuple[str, ...], bool], int] = {}
        self._numbers: list[array[float]] = []
        self._messages: list[array[int]] = []

    def take(self, state: Any, received: int) -> int:
        """Adds a message, and returns the number of its values; the error describes its fault."""
        names, signals = tuple(state.name), (state.position, state.velocity, state.effort)
        n = len(names)
        shape = names, len(state.position) > 0
        if shape not in self._shapes:
            self._add(shape)
        for what, values in zip(("positions", "velocities", "efforts"), signals):
            if len(values) not in (0, n):
                raise ValueError(f"it has {len(values)} {what} for {n} joints")
        numbers = [values if len(values) else np.full(n, np.nan) for values in signals]
        self._numbers[self._shapes[shape]].frombytes(np.concatenate(numbers).tobytes())
        self._messages[self._shapes[shape]].append(len(self.times))
        self.times.append(state.header.stamp.sec * 1_000_000_000 + state.header.stamp.nanosec)
        self.received.append(received)
        self.stamped |= self.times[-1] != 0
        return 3 * n + 3

    def _add(self, shape: tuple[tuple[str, ...], bool]) -> None:
        names = shape[0]
        if not all(names) or any("\0" in name for name in names):
            raise ValueError("it has a joint without a name, or with a zero byte in it")
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(f"it names joint '{shortened(twice)}' twice")
        for name in names:
            self.joints.setdefault(name, len(self.joints))
        if len(self.joints) > MOST_JOINTS:
            raise ValueError(f"with it, messages name more than {MOST_JOINTS} joints")
        self.first = self.first or len(self.joints)
        self._shapes[shape] = len(self._shapes)
        self._numbers.append(array("d"))
        self._messages.append(array("q"))

    def _parts(self) -> Iterator[tuple[tuple[str, ...], Any, Any]]:
        """Of each shape its names, the positions of its messages, and their numbers: positions, velocities, efforts of the names."""
        for (names, _), messages, numbers in zip(self._shapes, self._messages, self._numbers):
            yield names, np.array(messages), np.frombuffer(numbers).reshape(-1, 3, len(names))

    def have(self, is_so: Callable[[set[str], bool], bool]) -> Any:
        """For each message whether this holds of its names, and of whether it has positions."""
        result = np.zeros(len(self.times), dtype=bool)
        for (names, has_positions), messages in zip(self._shapes, self._messages):
            result[messages] = is_so(set(names), has_positions)
        return result

    def table(self, kept: Any) -> dict[str, Any]:
        """The time from the first message on, the positions, and those velocities and efforts of which any is finite."""
        rows, place = int(kept.sum()), np.cumsum(kept) - 1
        if rows * (1 + 3 * len(self.joints)) > MOST_NUMBERS:
            raise DataError(TOO_MANY)
        # The first stamp is subtracted from whole nanoseconds, which keeps every digit.
        times = np.array(self.times if self.stamped else self.received)[kept]
        columns = {"t": (times - times[0]) / 1e9}
        for name in (*self.joints, *self._recorded()):
            if name in columns:
                raise DataError(f"a joint has the name of a column, '{shortened(name)}': give it another in the bag")
            columns[name] = np.full(rows, np.nan)
        for names, messages, numbers in self._parts():
            own, to = numbers[kept[messages]], place[messages[kept[messages]]]
            for k, name in enumerate(names):
                for part, suffix in enumerate(("", *RATES)):
                    if name + suffix in columns:
                        columns[name + suffix][to] = own[:, part, k]
        return columns

    def _recorded(self) -> list[str]:
        """The velocities and efforts of which any is finite, in the order of the joints."""
        finite: dict[str, bool] = {name + suffix: False for suffix in RATES for name in self.joints}
        for names, _, numbers in self._parts():
            for suffix, known in zip(RATES, np.isfinite(numbers).any(axis=0)[1:]):
                for name, any_known in zip(names, known):
                    finite[name + suffix] |= bool(any_known)
        return [column for column, any_known in finite.items() if any_known]

    def columns(
        self, asked: Sequence[Sequence[str]], actuated: Sequence[str]
    ) -> tuple[list[list[str]], list[str]]:
        """The columns of q, qd and tau that were named, or all joints of the first message with the rates that all of them have."""
        notes = []
        if not self.stamped:
            notes.append("no message bears a time stamp: the times at which the recorder received them are used")
        recorded = set(self._recorded())
        q = list(asked[0]) or list(self.joints)[: self.first]
        columns = [q]
        for signal, suffix, plural, given in (("qd", RATES[0], "velocities", asked[1]), ("tau", RATES[1], "efforts", asked[2])):
            own = [name + suffix for name in (signal == "tau" and actuated) or q]
            columns.append(list(given) or (own if recorded.issuperset(own) else []))
            missing = [shortened(name) for name in q if name in self.joints and name + suffix not in recorded]
            if not columns[-1] and missing:
                notes.append(f"no {plural} of {', '.join(missing)} are recorded: {signal} is not known")
        return columns, notes

    def renamed(self, kept: Any, needed: Sequence[str]) -> dict[str, Any] | None:
        """The first message that names other joints than those that are needed, with the missing and the new ones.

        Messages of other joints among those that are kept come from other publishers, and are not a fault. A message with only some of
        the joints is a fault, and so is an end after which the joints do not return.
        """
        lacks = self.have(lambda names, _: not names.issuperset(needed))
        torn = self.have(lambda names, _: 0 < len(names.intersection(needed)) < len(needed))
        last = int(np.flatnonzero(kept)[-1])
        runs = np.diff(np.cumsum(lacks)[kept], prepend=0)
        if torn.any():
            at = int(torn.argmax())
        elif lacks[last:].sum() > PAUSE * max(runs.max(), 1):
            at = last + int(lacks[last:].argmax())
        else:
            return None
        names = next(own for own, messages, _ in self._parts() if at in messages)
        missing = [name for name in needed if name not in names]
        return {"message": at + 1, "missing": missing, "instead": [name for name in names if name not in needed]}


def _visit(path: Path, topic: str | None, found: dict[str, _States]) -> list[tuple[str, str]]:
    """Collects the joint states of a file by their topics, and returns all topics with their types."""
    try:
        from rosbags.rosbag2 import Reader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise MissingExtra("bags of ROS 2 are read by rosbags: pip install 'lagrangian[ros]'") from error
    store, left = get_typestore(Stores.ROS2_HUMBLE), MOST_NUMBERS
    try:
        _refuse_unfinished(path)
        with _bounded_chunks(), Reader(path) as reader:
            own = [one for one in reader.connections if (one.msgtype, one.ext.serialization_format) == (KIND, ENCODING)]
            own = [one for one in own if topic in (None, one.topic)]
            for one, received, data in reader.messages(own) if own else ():
                states = found.setdefault(one.topic, _States())
                try:
                    left -= states.take(store.deserialize_cdr(_plain(data), KIND), received)
                except Exception as error:
                    where = f"message {len(states.times) + 1} of '{shortened(one.topic)}'"
                    raise DataError(f"this is not a readable bag of ROS 2: {where}: {error}") from error
                if left < 0:
                    raise DataError(TOO_MANY)
            read = sum(len(states.times) for states in found.values())
            for what, count, summary in (
                ("joint states", read, sum(one.msgcount for one in own)),
                ("messages", reader.message_count, sum(one.msgcount for one in reader.connections)),
            ):
                # A summary may omit the counts.
                if summary not in (0, count):
                    raise DataError(f"it holds {count} {what} where its topics count {summary}: {DAMAGED}")
            return list(dict.fromkeys((one.topic, one.msgtype) for one in reader.connections))
    except DataError:
        raise
    except Exception as error:  # Damaged bags raise errors of many kinds.
        if "rofile is not ros2" in str(error):
            raise DataError("its messages are not those of ROS 2: convert those of ROS 1 with `rosbags-convert`") from error
        text = shortened(f"{type(error).__name__}: {error}")
        raise DataError(f"this is not a readable bag of ROS 2 ({text}): {DAMAGED}") from error


def _plain(data: bytes) -> bytes:
    """A message in plain CDR."""
    if data[:4] == b"\x28\xb5\x2f\xfd":
        raise ValueError("it is compressed by itself: write the bag again without compression, by `ros2 bag convert`")
    if data[:2] not in (b"\0\0", b"\0\1"):
        raise ValueError(f"its encoding {data[:2].hex()} is not plain CDR")
    return data


def _refuse_unfinished(path: Path) -> None:
    """Refuses a damaged database, and one with a log of writes beside it: messages of the log are not in the file yet."""
    if path.suffix != ".db3":
        return
    for log in (Path(f"{path}-wal"), Path(f"{path}-journal")):
        if log.exists() and log.stat().st_size:
            raise DataError(
                f"'{path}' was not closed: '{log}' holds changes that are not in it: complete a copy of both with "
                f"`sqlite3 {path} 'PRAGMA wal_checkpoint(TRUNCATE)'`"
            )
    with closing(sqlite3.connect(f"file:{pathname2url(str(path.absolute()))}?immutable=1", uri=True)) as base:
        [(finding,)] = base.execute("PRAGMA integrity_check(1)").fetchall()
        [(size,)] = base.execute("SELECT page_size * page_count FROM pragma_page_size, pragma_page_count")
    if size > path.stat().st_size:
        finding = f"it is cut off after {path.stat().st_size} of {size} bytes"
    if finding != "ok":
        raise ValueError(finding)


@contextmanager
def _bounded_chunks() -> Iterator[None]:
    """Chunks of MCAP unpack to no more than they claim and no more than ``LONGEST``; rosbags itself unpacks them to any size."""
    from lz4.frame import LZ4FrameDecompressor
    from rosbags.rosbag2.storage_mcap import DECOMPRESSORS, zstd

    def bounded(new: Callable[[], Any]) -> Callable[[bytes, int], bytes]:
        def unpacked(data: bytes, size: int) -> bytes:
            if size > LONGEST:
                raise ValueError(f"a chunk of {size} bytes is longer than what is read ({LONGEST} bytes)")
            whole = b""
            while data and len(whole) <= size:
                frame = new()
                whole += frame.decompress(data, size + 1 - len(whole))
                data = frame.unused_data if frame.eof else b""
            return whole

        return unpacked

    own = dict(DECOMPRESSORS)
    DECOMPRESSORS.update(lz4=bounded(LZ4FrameDecompressor), zstd=bounded(zstd.ZstdDecompressor))
    try:
        yield
    finally:
        DECOMPRESSORS.update(own)


def _listed(topics: Sequence[tuple[str, str]]) -> str:
    shown = [f"{shortened(name)} ({shortened(kind)})" for name, kind in topics[:MOST_LISTED]]
    if len(topics) > MOST_LISTED:
        shown.append(f"… {len(topics)} in all")
    return ", ".join(shown)


def _no_choice(topics: Sequence[tuple[str, str]], filled: int, topic: str | None) -> DataError:
    """The error for a bag without a unique topic; ``filled`` topics have joint states."""
    kinds = [kind for name, kind in topics if name == topic]
    shown, remedy = shortened(topic or ""), "name another with `topic`"
    if kinds == [KIND]:
        finding = f"topic '{shown}' has no message in {ENCODING}"
    elif kinds:
        finding = f"topic '{shown}' holds {', '.join(map(shortened, kinds))}, no {KIND}"
    elif topic is not None:
        finding = f"the bag has no topic '{shown}'"
    elif filled:
        finding, remedy = f"{filled} topics of the bag hold joint states", "choose one with `topic`"
    else:
        finding = f"the bag has no message of type {KIND}"
        remedy = "record a topic of joint states, or convert the messages to CSV"
    return DataError(f"{finding} (topics found: {_listed(topics) or 'none'}): {remedy}")
