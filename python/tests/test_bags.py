"""Joint states of ROS 2 bags: both containers give the same rows, choices and missing parts are reported, damaged bags are refused."""

from __future__ import annotations

import os
import shutil
import sqlite3
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lagrangian as lg

pytest.importorskip("rosbags")

from bags import KIND, START, STORE, TOPIC, State, state, states, write  # noqa: E402


def both(folder: Path, messages: list[State], **arguments: Any) -> lg.Trajectories:
    """What both containers of the messages give."""
    results: list[Any] = []
    for extension in ("db3", "mcap"):
        path = write(folder / f"bag{len(list(folder.iterdir()))}.{extension}", messages)
        try:
            results.append(lg.read(path, **arguments))
        except lg.errors.DataError as error:
            results.append(str(error).replace(str(path), "PATH"))
    a, b = results
    if isinstance(a, str):
        assert a == b
        raise lg.errors.DataError(a)
    assert [note.split("': ", 1)[1] for note in a.notes] == [note.split("': ", 1)[1] for note in b.notes]
    for one, other in zip(a, b, strict=True):
        for values, others in ((one.t, other.t), (one.q, other.q), (one.qd, other.qd), (one.tau, other.tau)):
            assert (values is None) == (others is None)
            if values is not None:
                np.testing.assert_array_equal(values, others)
    return a


def refusal(folder: Path, messages: list[State], **arguments: Any) -> str:
    with pytest.raises(lg.errors.DataError) as error:
        both(folder, messages, **arguments)
    return str(error.value)


def lagrangian(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Runs the command of the package."""
    return subprocess.run([sys.executable, "-m", "lagrangian", *words], cwd=folder, capture_output=True, text=True)


def test_joint_states_are_rows_with_names_of_joints_and_seconds_since_the_first(tmp_path: Path) -> None:
    messages = states(50)
    motions = both(tmp_path, messages)
    [motion] = motions
    assert [own.name for own in motion.coordinates] == ["shoulder", "elbow"] and not motions.notes
    np.testing.assert_array_equal(motion.t, np.arange(50) / 100)
    np.testing.assert_array_equal(motion.q, [own.position for own in messages])
    np.testing.assert_array_equal(motion.qd, [own.velocity for own in messages])
    np.testing.assert_array_equal(motion.tau, [own.effort for own in messages])


def test_compressed_chunks_hold_the_same(tmp_path: Path) -> None:
    plain, packed = (write(tmp_path / f"{k}.mcap", states(200), compressed=k == 1) for k in (0, 1))
    assert packed.stat().st_size < plain.stat().st_size
    np.testing.assert_array_equal(lg.read(packed)[0].q, lg.read(plain)[0].q)


def test_a_database_with_a_log_of_writes_that_is_complete_is_read(tmp_path: Path) -> None:
    path = write(tmp_path / "log.db3", states(5))
    content = bytearray(path.read_bytes())
    content[18:20] = b"\2\2"
    path.write_bytes(content)
    assert len(lg.read(path)[0].t) == 5


def test_joints_are_chosen_by_name_in_that_order_whatever_the_order_of_a_message(tmp_path: Path) -> None:
    def turned(k: int, own: State) -> State:
        parts = {name: getattr(own, name)[::-1] for name in ("names", "position", "velocity", "effort")}
        return replace(own, **parts) if k % 2 else own

    messages = states(10, turned)
    [motion] = both(tmp_path, messages, q=["elbow", "shoulder"])
    np.testing.assert_array_equal(motion.q, [(np.cos(k), np.sin(k)) for k in map(float, range(10))])
    elbow = both(tmp_path, messages, q="elbow")
    np.testing.assert_array_equal(elbow[0].tau[3:5, 0], [-3.0, -4.0])
    assert "columns not used: shoulder, shoulder velocity, shoulder effort" in elbow.notes[0]
    message = refusal(tmp_path, messages, q=["elbow", "wrist"])
    assert all(part in message for part in ("no column 'wrist'", "shoulder, elbow", "`q`"))


def test_messages_of_other_publishers_are_omitted_and_counted(tmp_path: Path) -> None:
    hand = [replace(state(k), names=["finger"], position=[0.0], velocity=(), effort=()) for k in range(10, 14)]
    motions = both(tmp_path, states(10) + hand)
    assert len(motions[0].t) == 10
    assert any("4 of 14 messages" in note and "finger" in note for note in motions.notes)
    message = refusal(tmp_path, states(10) + hand, q=["finger", "elbow"])
    assert all(part in message for part in ("no message", "finger", "`q`"))
    report = lagrangian("check", str(write(tmp_path / "hand.db3", states(10) + hand)), folder=tmp_path)
    assert "but finger" not in report.stdout


@pytest.mark.parametrize(
    "names, missing, instead",
    [
        (("shoulder", "elbow_joint"), "no joint elbow,", "but elbow_joint:"),
        (("left/shoulder", "left/elbow"), "no joint shoulder, elbow,", "but left/shoulder, left/elbow:"),
    ],
)
def test_joints_that_are_renamed_in_the_middle_of_a_bag_are_a_warning_with_their_place(
    tmp_path: Path, names: tuple[str, str], missing: str, instead: str
) -> None:
    messages = states(60, lambda k, own: replace(own, names=names) if k >= 24 else own)
    assert len(both(tmp_path, messages)[0].t) == 24
    report = lagrangian("check", str(write(tmp_path / "renamed.mcap", messages)), "--json", folder=tmp_path).stdout
    for part in ("message 25 of 60", missing, instead, "36 messages are omitted"):
        assert part in report


def test_joints_that_appear_late_are_read_where_they_are_named(tmp_path: Path) -> None:
    messages = states(40, lambda k, own: replace(own, names=("a", "b")) if k < 10 else own)
    [motion] = both(tmp_path, messages, q=["shoulder", "elbow"])
    assert len(motion.t) == 30 and motion.t[0] == 0.0


def test_signals_that_were_not_recorded_are_unknown_and_said_so(tmp_path: Path) -> None:
    messages = states(10, lambda _, own: replace(own, velocity=(), effort=(own.effort[0], float("nan"))))
    motions = both(tmp_path, messages)
    assert motions[0].qd is None and motions[0].tau is None
    text = "\n".join(motions.notes)
    assert "no velocities of shoulder, elbow are recorded: qd is not known" in text
    assert "no efforts of elbow are recorded: tau is not known" in text
    [driven] = both(tmp_path, messages, actuated="shoulder")
    np.testing.assert_array_equal(driven.tau[:2], [[1.0, 0.0], [0.5, 0.0]])


def test_a_value_that_is_missing_in_some_messages_is_a_fault_of_the_check(tmp_path: Path) -> None:
    messages = states(50, lambda k, own: replace(own, effort=()) if k == 3 else own)
    path = write(tmp_path / "gap.db3", messages)
    report = lagrangian("check", str(path), folder=tmp_path)
    assert report.returncode == 1 and "shoulder effort" in report.stdout


def test_without_stamps_the_times_of_the_recorder_are_taken(tmp_path: Path) -> None:
    motions = both(tmp_path, states(10, lambda _, own: replace(own, stamp=0)))
    np.testing.assert_array_equal(motions[0].t[8:], [0.08, 0.09])
    assert any("recorder" in note for note in motions.notes)


@pytest.mark.parametrize("change, finding", [(0, "stands still"), (-20_000_000, "goes back")])
def test_stamps_that_stand_still_or_go_back_fail_the_check(tmp_path: Path, change: int, finding: str) -> None:
    def turned(k: int, own: State) -> State:
        return replace(own, stamp=state(49).stamp + change) if k == 50 else own

    path = write(tmp_path / "stamps.mcap", states(100, turned))
    report = lagrangian("check", str(path), folder=tmp_path)
    assert report.returncode == 1 and finding in report.stdout


def test_of_several_topics_one_must_be_chosen(tmp_path: Path) -> None:
    messages = states(10) + [replace(own, topic="/copy") for own in states(7)]
    message = refusal(tmp_path, messages)
    assert all(part in message for part in ("2 topics", f"/copy ({KIND})", f"{TOPIC} ({KIND})", "`topic`"))
    copy = both(tmp_path, messages, topic="/copy")
    assert len(copy[0].t) == 7 and any("topics not used: /joint_states" in note for note in copy.notes)
    message = refusal(tmp_path, messages, topic="/other")
    assert "no topic '/other'" in message and "/copy" in message
    refused = lagrangian("check", str(write(tmp_path / "two.db3", messages)), folder=tmp_path)
    assert refused.returncode == 2 and "choose one with --topic" in refused.stderr


def test_names_are_shown_short_and_without_hidden_characters(tmp_path: Path) -> None:
    messages = [replace(own, topic=topic) for own in states(3) for topic in ("/a\u202eb", "/" + "k" * 500)]
    message = refusal(tmp_path, messages)
    assert r"/a\u{202e}b" in message and "k" * 61 not in message


def test_a_bag_without_joint_states_lists_what_it_has(tmp_path: Path) -> None:
    others = [("/scan", "sensor_msgs/msg/LaserScan"), ("/empty", KIND)]
    for extension in ("db3", "mcap"):
        path = write(tmp_path / f"none.{extension}", [], others=others)
        with pytest.raises(lg.errors.DataError, match=r"no message of type .*/scan \(sensor_msgs/msg/LaserScan\)"):
            lg.read(path)
        with pytest.raises(lg.errors.DataError, match="'/scan' holds sensor_msgs/msg/LaserScan"):
            lg.read(path, topic="/scan")


def database(path: Path, topics: list[tuple[str, str]], messages: list[tuple[int, int, bytes]]) -> Path:
    """A database of topics, and of messages with the numbers of their topics: ``rosbags`` needs minutes for many topics."""
    base = sqlite3.connect(path)
    base.execute(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT)"
    )
    base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    rows = [(name, kind, "cdr", "") for name, kind in topics]
    base.executemany("INSERT INTO topics(name, type, serialization_format, offered_qos_profiles) VALUES (?, ?, ?, ?)", rows)
    base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", messages)
    base.commit()
    base.close()
    return path


def test_tens_of_thousands_of_topics_are_read_in_a_pass(tmp_path: Path) -> None:
    scans = [(f"/topic/{k}", "sensor_msgs/msg/LaserScan") for k in range(60_000)]
    messages = [(60_001, own.received, own.bytes()) for own in states(10)]
    begun = time.monotonic()
    motions = lg.read(database(tmp_path / "many.db3", [*scans, (TOPIC, KIND)], messages))
    assert len(motions[0].t) == 10 and any("60000 in all" in note for note in motions.notes)
    data = state(0).bytes()
    joints = [(f"/topic/{k}", KIND) for k in range(20_000)]
    path = database(tmp_path / "each.db3", joints, [(k, k, data) for k in range(1, 20_001)])
    with pytest.raises(lg.errors.DataError, match="20000 topics.*`topic`"):
        lg.read(path)
    # Time that grew with the square of the topics would be minutes.
    assert time.monotonic() - begun < 60


def test_what_is_no_bag_is_refused(tmp_path: Path) -> None:
    for extension in ("db3", "mcap"):
        for content in (b"", b"t,q1\n0,1\n", b"\x89MCAP0\r\n"):
            path = tmp_path / f"no.{extension}"
            path.write_bytes(content)
            with pytest.raises(lg.errors.DataError, match="not a readable bag of ROS 2"):
                lg.read(path)
    endless = (
        "CREATE TABLE topics(x); CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT * FROM n"
    )
    for k, text in enumerate(("CREATE TABLE songs(x)", endless, "CREATE TABLE messages(x); CREATE TABLE topics(y)")):
        base = sqlite3.connect(tmp_path / f"{k}.db3")
        base.executescript(text)
        base.close()
        with pytest.raises(lg.errors.DataError, match="not a readable bag of ROS 2"):
            lg.read(tmp_path / f"{k}.db3")


def test_messages_that_are_no_joint_states_are_named(tmp_path: Path) -> None:
    faults: list[tuple[str, Callable[[State], State]]] = [
        ("message 3 of '/joint_states': it has 1 positions for 2 joints", lambda own: replace(own, position=own.position[:1])),
        ("it names joint 'elbow' twice", lambda own: replace(own, names=("elbow", "elbow"))),
        ("a joint without a name", lambda own: replace(own, names=("elbow", ""))),
        ("more than 1000 joints", lambda own: State([f"j{k}" for k in range(1001)], [0.0] * 1001)),
    ]
    for fault, change in faults:
        assert fault in refusal(tmp_path, states(5, lambda k, own: change(own) if k == 2 else own))  # noqa: B023
    plain = state(0).bytes()
    for fault, data in (
        ("ros2 bag convert", b"\x28\xb5\x2f\xfd" + plain),
        ("encoding 0003 is not plain CDR", b"\0\3" + plain[2:]),
        ("message 1", plain[:60]),
        ("message 1", plain[:24] + b"\xff\xff\xff\xff" + plain[28:]),
    ):
        path = database(tmp_path / f"{len(list(tmp_path.iterdir()))}.db3", [(TOPIC, KIND)], [(1, START, data)])
        with pytest.raises(lg.errors.DataError, match=fault):
            lg.read(path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three bags of the same 200 messages."""
    folder = tmp_path_factory.mktemp("whole")
    packed = [write(folder / "packed.mcap", states(200), compressed=True)]
    return [*packed, *(write(folder / f"plain.{extension}", states(200)) for extension in ("db3", "mcap"))]


def test_a_bag_that_is_cut_anywhere_is_refused(whole: list[Path], tmp_path: Path) -> None:
    for path in whole:
        content = path.read_bytes()
        ends = [len(content) * k // 50 + k % 7 for k in range(50)]
        for end in (*ends, len(content) - 1):
            cut = tmp_path / path.name
            cut.write_bytes(content[:end])
            with pytest.raises(lg.errors.DataError):
                lg.read(cut)


def test_a_bag_with_a_flipped_bit_is_refused_or_read_and_never_silently_partial(whole: list[Path], tmp_path: Path) -> None:
    for path in whole:
        content = path.read_bytes()
        for k in range(200):
            damaged = bytearray(content)
            # Multiples of the golden ratio reach all parts of the file.
            at = int(0.618_033_988_75 * k % 1.0 * len(content))
            damaged[at] ^= 1 << k % 8
            other = tmp_path / path.name
            other.write_bytes(damaged)
            try:
                motions = lg.read(other)
            except lg.errors.DataError:
                continue
            assert len(motions[0].t) == 200 or motions.notes, (path, at)


def test_a_chunk_that_unpacks_to_more_than_it_claims_is_refused_without_memory_for_it(whole: list[Path], tmp_path: Path) -> None:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd

    resource = pytest.importorskip("resource")
    bomb = b"".join([zstd.compress(bytes(1 << 30))] * 4)
    text = struct.pack("<I", 4) + b"zstd"
    for claimed in (1000, 1 << 30, 1 << 62):
        chunk = struct.pack("<QQQI", 0, 1 << 62, claimed, 0) + text + struct.pack("<Q", len(bomb)) + bomb
        magic, header = b"\x89MCAP0\r\n", struct.pack("<I", 4) + b"ros2" + struct.pack("<I", 0)
        records = [(1, header), (6, chunk), (15, bytes(4)), (2, bytes(20))]
        path = tmp_path / "bomb.mcap"
        path.write_bytes(magic + b"".join(struct.pack("<BQ", code, len(data)) + data for code, data in records) + magic)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with pytest.raises(lg.errors.DataError):
            lg.read(path)
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 700_000


def test_a_bag_that_was_not_closed_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.db3", states(5))
    Path(f"{path}-wal").write_text("changes")
    with pytest.raises(lg.errors.DataError, match="was not closed"):
        lg.read(path)


def test_more_numbers_than_fit_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from lagrangian import _bags

    monkeypatch.setattr(_bags, "MOST_NUMBERS", 50)
    assert "divide the bag" in refusal(tmp_path, states(10))


def test_the_command_reads_a_bag_and_its_folder_and_remembers_its_hash(tmp_path: Path) -> None:
    (tmp_path / "swing").mkdir()
    for k in (0, 1):
        write(tmp_path / "swing" / f"swing_{k}.mcap", [replace(own, effort=()) for own in states(300)])
    (tmp_path / "swing" / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - swing_0.mcap\n    - swing_1.mcap\n"
    )
    check = lagrangian("check", "swing/swing_0.mcap", "--angle", "all", folder=tmp_path)
    assert "no efforts of shoulder, elbow" in check.stderr
    converted = lagrangian("convert", "swing", "--angle", "all", "--out", "table.csv", "--json", folder=tmp_path)
    assert '"rows": 600' in converted.stdout and '"trajectories": 2' in converted.stdout
    table = (tmp_path / "table.csv").read_text()
    assert table.startswith("trajectory,t,q1,q2,qd1,qd2\nswing_0,0,") and "\nswing_1,0,0,1,0," in table
    refused = lagrangian("check", "swing", "--q", "wrist", folder=tmp_path)
    assert refused.returncode == 2 and "--q" in refused.stderr and "elbow velocity" in refused.stderr
    fit = lagrangian("fit", "swing", "--steps", "2", "--width", "4", "--out", "run", "--quiet", folder=tmp_path)
    assert "swing/swing_0.mcap" in (tmp_path / "run" / "run.toml").read_text(), fit.stderr


def test_the_files_of_a_bag_are_those_of_its_list_and_lie_in_its_folder(tmp_path: Path) -> None:
    from lagrangian import _bags

    text = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - a_0.db3\n    - \"a_1.db3\"\n  duration:\n    - no\n"
    (tmp_path / "metadata.yaml").write_text(text)
    assert _bags.files(tmp_path) == [tmp_path / "a_0.db3", tmp_path / "a_1.db3"]
    for content, fault in (("version: 5\n", "names no file"), (text.replace("a_0", "../a"), "outside"), (text.replace("a_0", "/a"), "outside")):
        (tmp_path / "metadata.yaml").write_text(content)
        with pytest.raises(lg.errors.DataError, match=fault):
            lg.read(tmp_path)
    (tmp_path / "metadata.yaml").unlink()
    (tmp_path / "metadata.yaml").mkdir()
    with pytest.raises(lg.errors.DataError, match="is not a file"):
        lg.read(tmp_path)


def test_without_rosbags_the_error_names_the_extra(
    tmp_path: Path, whole: list[Path], without: Callable[[str], None]
) -> None:
    without("rosbags")
    with pytest.raises(lg.errors.MissingExtra, match=r"pip install 'lagrangian\[ros\]'"):
        lg.read(whole[0])


def test_bags_of_real_robots_hold_what_the_tables_beside_them_hold() -> None:
    data = Path(os.environ.get("LAGRANGIAN_DATA", Path(__file__).parents[3] / "shared" / "data"))
    if not data.is_dir():
        pytest.skip(f"skipped: there is no folder {data}")
    for name in ("ur10", "panda"):
        [bag] = lg.read(data / f"{name}_real" / f"{name}_exciting_trajectory.db3")
        [table] = lg.read(data / f"{name}_real" / f"{name}.csv")
        # The tables have nine digits.
        for signal in ("t", "q", "qd", "tau"):
            own, expected = getattr(bag, signal), getattr(table, signal)
            assert np.all(np.abs(own - expected) <= 5.1e-9 * np.maximum(np.abs(expected), 1e-9)), (name, signal)
