"""Logs written message by message."""

import json
from contextlib import contextmanager

import numpy as np
from mcap.writer import CompressionType, Writer

UNITS = {"displacement": "m", "velocity": "m/s", "force": "N", "coil_drive": "V"}


class Log:
    """Writer of messages in the format of the bench."""

    def __init__(self, writer):
        self.writer = writer
        schema = writer.register_schema("any", "jsonschema", b"{}")
        self.topics = {
            topic: writer.register_channel(topic, "json", schema)
            for topic in ("/bench/sample", "/bench/segment", "/bench/event")
        }

    def put(self, topic, time, message):
        nanoseconds = round(time * 1e9)
        stamped = {"timestamp": {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}} | message
        body = json.dumps(stamped).encode()
        self.writer.add_message(self.topics[topic], nanoseconds, body, nanoseconds)

    def samples(self, times, **fields):
        for k, time in enumerate(times):
            values = {"displacement": k * 1e-5, "velocity": 0.01, "force": float(k), "coil_drive": 0.5}
            self.put("/bench/sample", time, values | {name: column[k] for name, column in fields.items()})

    def segment(self, phase, time, index=0, stretch="method", **fields):
        values = {"name": f"segment {index}", "motion": "sine", "amplitude": 0.01, "frequency": 2.0}
        mark = values | {"phase": phase, "index": index, "stretch": stretch, "drive_value": None} | fields
        self.put("/bench/segment", time, mark)


@contextmanager
def writing(path, units=UNITS, channels=None, compression=CompressionType.ZSTD, **more):
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=5000, compression=compression, **more)
        writer.start("mrbench")
        writer.add_metadata("run", {"drive_kind": "coil_v", "method": "quick"})
        if units is not None:
            writer.add_metadata("units", units)
        if channels is not None:
            writer.add_metadata("channels", channels)
        yield Log(writer)
        writer.finish()


def times(count, start=0.0, rate=1000.0):
    return start + np.arange(count) / rate
