"""Writes the rows of a CSV file as the joint states of a ROS 2 bag: `python3 bag.py log.csv bag.db3`, or `.mcap`."""

import csv
import sqlite3
import struct
import sys

TOPIC, KIND, JOINTS = "/joint_states", "sensor_msgs/msg/JointState", ("shoulder", "elbow")
START = 1_763_000_000


def text(data, words):
    data += b"\0" * (-len(data) % 4)
    return data + struct.pack("<I", len(words) + 1) + words.encode() + b"\0"


def message(row):
    """A joint state in CDR, and its time, ns."""
    time = START * 10**9 + round(float(row["t"]) * 1e9)
    data = text(struct.pack("<iI", time // 10**9, time % 10**9), "base")
    data += b"\0" * (-len(data) % 4) + struct.pack("<I", len(JOINTS))
    for name in JOINTS:
        data = text(data, name)
    for signal in ("q", "qd", "tau"):
        data += b"\0" * (-len(data) % 4) + struct.pack("<I", len(JOINTS))
        data += b"\0" * (-len(data) % 8)
        data += struct.pack("<2d", *(float(row[signal + name]) for name in ("1", "2")))
    return time, b"\0\1\0\0" + data


def write_db3(path, messages):
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT)")
    base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    base.execute("INSERT INTO topics VALUES (1, ?, ?, 'cdr', '')", (TOPIC, KIND))
    base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?, ?)", messages)
    base.commit()


def write_mcap(path, messages):
    def record(code, data):
        return struct.pack("<BQ", code, len(data)) + data

    def words(own):
        return struct.pack("<I", len(own)) + own.encode()

    magic = b"\x89MCAP0\r\n"
    with open(path, "wb") as file:
        file.write(magic + record(1, words("") + words("documents")))
        file.write(record(3, struct.pack("<H", 1) + words(KIND) + words("ros2msg") + words("")))
        file.write(record(4, struct.pack("<HH", 1, 1) + words(TOPIC) + words("cdr") + struct.pack("<I", 0)))
        for k, (time, data) in enumerate(messages):
            file.write(record(5, struct.pack("<HIQQ", 1, k, time, time) + data))
        file.write(record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + magic)


with open(sys.argv[1], newline="") as log:
    rows = [message(row) for row in csv.DictReader(log) if row.get("trajectory", "0") == "0"]
(write_mcap if sys.argv[2].endswith(".mcap") else write_db3)(sys.argv[2], rows)
