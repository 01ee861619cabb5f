"""Makes tensorboard.golden: the bytes that TensorBoard's own code writes for the events of the test.

Run by hand, never by the tests:  pip install tensorboard && python tests/recipes/tensorboard_golden.py > src/tensorboard.golden
It reads the file back with TensorBoard's own loader before it prints.
"""
import io
import os
import sys
import tempfile

from tensorboard.backend.event_processing.event_file_loader import RawEventFileLoader
from tensorboard.compat.proto import event_pb2, summary_pb2
from tensorboard.summary.writer.record_writer import RecordWriter

value = summary_pb2.Summary.Value
summary = summary_pb2.Summary(
    value=[value(tag="loss/train", simple_value=0.25), value(tag="lr", simple_value=1e-3)]
)
events = [
    event_pb2.Event(wall_time=1.5, file_version="brain.Event:2"),
    event_pb2.Event(wall_time=2.5, step=300, summary=summary),
]


class Kept(io.BytesIO):
    def close(self):
        pass


buffer = Kept()
writer = RecordWriter(buffer)
for event in events:
    writer.write(event.SerializeToString(deterministic=True))
data = buffer.getvalue()

with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "events.out.tfevents.0.x")
    with open(path, "wb") as file:
        file.write(data)
    read = [event_pb2.Event.FromString(raw) for raw in RawEventFileLoader(path).Load()]
assert read == events, read
print(data.hex())
