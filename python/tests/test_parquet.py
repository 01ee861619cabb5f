"""Parquet files: columns of numbers, lists and names are read, other types are refused, and damage takes no memory."""

from __future__ import annotations

import io
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lagrangian as lg

pyarrow = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

EXPORTS = Path(__file__).parents[2] / "crates" / "lagrangian-recordings" / "tests" / "exports"


def saved(path: Path, **columns: Any) -> Path:
    parquet.write_table(pyarrow.table(columns), path)
    return path


def refusal(path: Path, **arguments: Any) -> str:
    with pytest.raises(lg.errors.DataError) as error:
        lg.read(path, **arguments)
    return str(error.value)


def lagrangian(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Runs the command of the package."""
    return subprocess.run([sys.executable, "-m", "lagrangian", *words], cwd=folder, capture_output=True, text=True)


def test_motions_come_back_to_the_bit_with_their_names_and_angles(tmp_path: Path) -> None:
    motions = lg.simulate("double-pendulum", trajectories=3, duration=1.0, drive=2.0, seed=4)
    lg.write(tmp_path / "motions.parquet", motions)
    again = lg.read(tmp_path / "motions.parquet")
    assert list(again) == list(motions) and again[0].coordinates == motions[0].coordinates
    names = parquet.read_schema(tmp_path / "motions.parquet").names
    assert names == ["trajectory", "t", "q1", "q2", "qd1", "qd2", "qdd1", "qdd2", "tau1", "tau2"]


def test_lists_are_columns_and_episodes_are_trajectories() -> None:
    lists = {"time": "timestamp", "q": "observation.state", "angles": "observation.state"}
    motions = lg.read(EXPORTS / "lerobot.parquet", trajectory="episode_index", **lists)
    assert [motion.name for motion in motions] == ["0", "1"]
    assert motions[0].n == 2 and len(motions[0]) == 6
    np.testing.assert_allclose(np.diff(motions[0].t), 1 / 30, rtol=1e-6)
    assert "action" in motions.notes[0] and "action1" not in motions.notes[0]
    message = refusal(EXPORTS / "lerobot.parquet")
    assert "LeRobot" in message and "`trajectory` 'episode_index'" in message


def test_the_command_reads_and_writes_them(tmp_path: Path) -> None:
    lists = ["--time", "timestamp", "--q", "observation.state", "--trajectory", "episode_index"]
    ended = lagrangian("convert", str(EXPORTS / "lerobot.parquet"), *lists, "--out", "log.parquet", folder=tmp_path)
    assert "2 trajectories, 12 rows" in ended.stderr, ended.stderr
    lagrangian("convert", "log.parquet", "--out", "back.csv", folder=tmp_path)
    lagrangian("convert", str(EXPORTS / "lerobot.parquet"), *lists, "--out", "same.csv", folder=tmp_path)
    assert (tmp_path / "back.csv").read_text() == (tmp_path / "same.csv").read_text()
    ended = lagrangian("simulate", "pendulum", "--duration", "1", "--out", "bag.mcap", folder=tmp_path)
    assert ended.returncode == 2 and ".csv, .npz or .parquet" in ended.stderr
    left = [path for path in tmp_path.iterdir() if path.suffix not in (".parquet", ".csv", ".toml")]
    assert not left


def test_a_list_of_another_length_is_refused_and_one_that_is_missing_is_not_a_number(tmp_path: Path) -> None:
    t = [0.0, 0.1, 0.2]
    whole = saved(tmp_path / "a.parquet", t=t, q=[[1.0, 2.0], None, [3.0, 4.0]])
    assert np.isnan(lg.read(whole)[0].q[1]).all()
    fixed = pyarrow.array([[1, 2], [3, 4], [5, 6]], pyarrow.list_(pyarrow.int8(), 2))
    assert lg.read(saved(tmp_path / "b.parquet", t=t, q=fixed))[0].q.tolist() == [[1, 2], [3, 4], [5, 6]]
    assert "has 1 numbers, the first has 2" in refusal(saved(tmp_path / "c.parquet", t=t, q=[[1.0, 2.0], [1.0], [2.0]]))
    assert "not 1 to 4096" in refusal(saved(tmp_path / "d.parquet", t=t, q=[[], [1.0], [2.0]]))


def test_numbers_of_each_type_are_read_and_stamps_and_durations_are_not(tmp_path: Path) -> None:
    for kind in ("int8", "uint16", "int64", "uint64", "float32", "float64"):
        numbers = pyarrow.array([0, 1, None], getattr(pyarrow, kind)())
        [motion] = lg.read(saved(tmp_path / f"{kind}.parquet", t=[0.0, 1.0, 2.0], q1=numbers))
        assert motion.q[:2, 0].tolist() == [0.0, 1.0] and np.isnan(motion.q[2, 0])
    whole = pyarrow.array([0, 1, 2], pyarrow.int64())
    for kind, named in ((pyarrow.timestamp("ns"), "timestamp"), (pyarrow.duration("us"), "duration"), (pyarrow.date64(), "date")):
        message = refusal(saved(tmp_path / "stamps.parquet", t=whole.cast(kind), q1=[0.1, 0.2, 0.3]))
        assert "'t'" in message and named in message, message
    assert "text" in refusal(saved(tmp_path / "words.parquet", t=["0", "1", "2"], q1=[0.1, 0.2, 0.3]))


def test_names_of_trajectories_may_be_categories_or_missing(tmp_path: Path) -> None:
    runs = pyarrow.array(["first", "first", "zwölf", "zwölf", None, None]).dictionary_encode()
    path = saved(tmp_path / "runs.parquet", trajectory=runs, t=[0.0, 0.1] * 3, q1=np.arange(6.0), spare=["x"] * 6)
    motions = lg.read(path)
    assert [motion.name for motion in motions] == ["first", "zwölf", ""]
    assert motions.notes == [f"'{path}': columns not used: spare"]
    long = saved(tmp_path / "long.parquet", trajectory=["k" * 2000] * 2, t=[0.0, 0.1], q1=[0.0, 0.1])
    assert "2000 bytes, more than 1024" in refusal(long)


def test_a_sample_of_a_long_log_is_that_of_its_csv(tmp_path: Path) -> None:
    motions = lg.simulate("pendulum", trajectories=2, duration=200.0, seed=3)
    read = []
    for extension in ("csv", "parquet"):
        lg.write(tmp_path / f"long.{extension}", motions)
        read.append(lg.read(tmp_path / f"long.{extension}", rows=10_000))
    assert list(read[0]) == list(read[1]) and sum(len(motion) for motion in read[0]) <= 10_000


def number(left: int) -> bytes:
    """A number of the footer, the lowest seven bits first."""
    out = b""
    while left > 0x7F:
        out += bytes([left & 0x7F | 0x80])
        left >>= 7
    return out + bytes([left])


def field(value: int) -> bytes:
    """An ``i32`` field after the last one."""
    return b"\x15" + number((value << 1 ^ value >> 63) & (1 << 64) - 1)


def nested(depth: int) -> bytes:
    """A file that consists of a footer: so many groups of columns within each other."""
    root, group = b"\x48\6schema" + field(1) + b"\0", b"\x35\0\x18\1g" + field(1) + b"\0"
    leaf = field(5) + b"\x25\0\x18\1x\0"
    columns = b"\x19\xfc" + number(depth + 2) + root + group * depth + leaf
    return footed(field(1) + columns + b"\x16\0\x19\x0c\0")


def footed(footer: bytes, claimed: int | None = None) -> bytes:
    return b"PAR1" + footer + struct.pack("<I", len(footer) if claimed is None else claimed) + b"PAR1"


def test_files_that_claim_more_than_they_hold_are_refused_and_take_no_memory(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    file = io.BytesIO()
    times = np.tile(np.arange(40) / 10, 2)
    columns = {"trajectory": ["one"] * 40 + ["two"] * 40, "t": times, "q1": np.sin(times)}
    parquet.write_table(pyarrow.table(columns), file, compression="NONE")
    good = file.getvalue()
    # The first page is the dictionary of names: its kind, its size in memory and in the file, and the number of its values.
    assert good[4:].startswith(field(2) + field(14) + field(14))

    def first(memory: int, size: int, values: int) -> bytes:
        header = field(2) + field(memory) + field(size) + b"\x4c" + field(values) + field(0) + b"\0\0"
        return good[:4] + header + good[4 + len(header) :]

    damaged = [first(14, 14, values) for values in (10**8, 2**31 - 1, -1)]
    damaged += [first(2 * 10**9, 14, 2), first(14, 2 * 10**9, 2), nested(4_200), nested(15_000), nested(200_000)]
    damaged += [footed(b"", 1 << 20), footed(b"", 2**32 - 1), good[:-100], b""]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for k, content in enumerate(damaged):
        (tmp_path / f"{k}.parquet").write_bytes(content)
        assert "Parquet" in refusal(tmp_path / f"{k}.parquet")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000
    # Runs of one value take no room in the file.
    zeros = pyarrow.array(np.zeros(1 << 20))
    endless = saved(tmp_path / "endless.parquet", t=zeros, **{f"q{k}": zeros for k in range(1, 200)})
    assert "its columns take" in refusal(endless, rows=100)


def test_a_page_whose_checksum_is_another_is_refused(tmp_path: Path) -> None:
    times = np.arange(20) / 10
    options = {"write_page_checksum": True, "use_dictionary": False, "compression": "NONE"}
    path = tmp_path / "sums.parquet"
    parquet.write_table(pyarrow.table({"t": times, "q1": times}), path, **options)
    content = bytearray(path.read_bytes())
    content[content.index(times.tobytes()) + 50] ^= 1
    path.write_bytes(content)
    assert "CRC" in refusal(path) or "checksum" in refusal(path)


def test_changed_bytes_are_read_or_refused(tmp_path: Path) -> None:
    lg.write(tmp_path / "a.parquet", lg.simulate("pendulum", duration=0.3))
    whole, random = (tmp_path / "a.parquet").read_bytes(), np.random.default_rng(1)
    for _ in range(300):
        content = bytearray(whole)
        for at in random.integers(len(content), size=random.integers(1, 8)):
            content[at] = random.integers(256)
        (tmp_path / "a.parquet").write_bytes(content)
        try:
            lg.read(tmp_path / "a.parquet")
        except lg.errors.LagrangianError:
            pass


def test_without_pyarrow_the_error_names_the_line_to_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(tmp_path / "a.parquet", t=[0.0, 0.1], q1=[0.0, 0.1])
    [motion] = lg.read(path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    for call in (lambda: lg.read(path), lambda: lg.write(tmp_path / "b.parquet", motion)):
        with pytest.raises(lg.errors.MissingExtra, match=r"pip install 'lagrangian\[parquet\]'"):
            call()
