"""A log made over the wires, and its frames through the decoders once more."""

import contextlib
import json
import resource
import sys
import time

import jsonschema
import orjson
import pytest
from can_rig import wait_until
from mcap.reader import make_reader
from mcap.writer import Writer
from test_clock_alignment import built, connected, rig

from bench.recorder.header import RunHeader
from bench.recorder.live import LiveRecorder
from bench.recorder.messages import message_schema
from bench.recorder.reader import read_log
from bench.replay.compare import replay_frames
from bench.replay.raw import DESCRIPTIONS
from bench.rig.acquisition import Acquisition
from bench.rig.alignment import Aligner
from drivers.replay import describe

pytestmark = pytest.mark.timeout(180)
HEADER = RunHeader(
    id="wires", specimen="damper 7", method="hold", drive_kind="coil_v", drive_unit="V", source="run"
)
SECONDS = 5.0


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A log of some seconds of the whole simulated rig."""
    path = tmp_path_factory.mktemp("wires") / "run.mcap"
    with rig() as (wires, _, _), connected(built(wires)) as instruments:
        logs = []

        def taken(batch):
            aligner.feed(batch)
            for one in logs:
                one.blocks(batch.instrument, batch.blocks)

        for name, instrument in instruments.items():
            instrument.listen(lambda frame, name=name: [one.frame(name, frame) for one in logs])
        acquisition = Acquisition(instruments, taken, pytest.fail, idle={"actuator": instruments["actuator"]})
        aligner = Aligner(acquisition.maps, "coil_voltage")
        with contextlib.ExitStack() as stack:
            stack.callback(acquisition.stop)
            acquisition.start()
            wait_until(lambda: aligner.ready() is not None, 20)
            recorder = stack.enter_context(LiveRecorder(path, HEADER, maps=acquisition.maps))
            logs.append(recorder)
            described = {name: describe(instrument) for name, instrument in instruments.items()}
            recorder.attach(DESCRIPTIONS, "application/json", orjson.dumps(described))
            end = time.monotonic() + SECONDS

            def over():
                if (ready := aligner.ready()) is not None:
                    recorder.samples(ready.time_ns, ready.columns)
                time.sleep(0.02)
                return time.monotonic() > end

            used = resource.getrusage(resource.RUSAGE_SELF)
            wait_until(over, SECONDS + 10)
            now = resource.getrusage(resource.RUSAGE_SELF)
            logs.clear()
            assert recorder.dropped == {}
    cpu = (now.ru_utime - used.ru_utime + now.ru_stime - used.ru_stime) / SECONDS
    sys.stdout.write(f"agent {cpu:.1%} of a core, log {path.stat().st_size / SECONDS / 1e3:.0f} kB/s\n")
    return path


def test_every_instrument_gives_the_same_samples_bit_for_bit(log):
    found = {one.instrument: one for one in replay_frames(log)}
    assert set(found) == {"actuator", "load_cell", "lvdt", "coil_amplifier", "thermometer"}
    for one in found.values():
        sys.stdout.write(f"{one}\n")
        assert one.equal
    assert found["load_cell"].samples > 1000
    assert found["lvdt"].samples > 500


def test_messages_keep_to_their_schemas(log):
    with log.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic.startswith(("/wire/", "/instrument/")):
                assert json.loads(schema.data) == message_schema(channel.topic)
                jsonschema.validate(json.loads(message.data), message_schema(channel.topic))


def test_the_log_reads_as_any_other(log):
    whole = read_log(log)
    assert whole.outcome == "clean"
    assert {"force_raw", "actuator_position", "temperature"} <= set(whole.samples)
    assert int(whole.metadata["outcome"]["/wire/load_cell"]) > 0


def flipped(log, out, topic):
    """The log with one bit of a frame of a topic turned over."""
    with log.open("rb") as file, out.open("wb") as other:
        reader, writer = make_reader(file), Writer(other)
        writer.start("mrbench", "test")
        schemas, channels = {}, {}
        messages = list(reader.iter_messages(log_time_order=False))
        own = [n for n, (_, channel, _) in enumerate(messages) if channel.topic == topic]
        chosen = own[len(own) // 2]
        for number, (schema, channel, message) in enumerate(messages):
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, "json", schemas[schema.id])
            data = turned(message.data) if number == chosen else message.data
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for document in reader.iter_attachments():
            writer.add_attachment(0, 0, document.name, document.media_type, document.data)
        writer.finish()


def turned(data):
    content = json.loads(data)
    longest = max((n for n, sent in enumerate(content["sent"]) if not sent), key=lambda n: len(content["data"][n]))
    text = content["data"][longest]
    at = len(text) // 5  # among the samples, not in what a block leaves empty
    content["data"][longest] = text[:at] + ("A" if text[at] != "A" else "B") + text[at + 1 :]
    return json.dumps(content).encode()


@pytest.mark.parametrize("name", ["load_cell", "lvdt", "coil_amplifier"])
def test_a_single_flipped_byte_is_noticed(log, tmp_path, name):
    other = tmp_path / "flipped.mcap"
    flipped(log, other, f"/wire/{name}")
    found = {one.instrument: one for one in replay_frames(other)}
    assert found[name].differences > 0
    assert all(one.equal for one in found.values() if one.instrument != name)
