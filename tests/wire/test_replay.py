"""A log recorded over the wires, and its frames decoded again."""

import contextlib
import json
import resource
import sys
import time

import jsonschema
import orjson
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from bench.log.header import RunHeader
from bench.log.messages import make_message_schema
from bench.log.reader import read_log
from bench.log.readings import DECODERS_FILE
from bench.recorder.live_recorder import LiveRecorder
from bench.replay.compare import replay_frames
from bench.rig.acquisition import Acquisition
from bench.rig.alignment import Aligner
from drivers.replay.decoder_snapshot import snapshot_decoder
from tests.support.can_rig import wait_until
from tests.wire.test_clock_alignment import build_drivers, connected, rig

pytestmark = pytest.mark.timeout(180)
HEADER = RunHeader(
    id="wires", specimen="damper 7", method="hold", drive_kind="coil_v", drive_unit="V", source="run"
)
SECONDS = 5.0


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Return a log of some seconds of the complete simulated rig."""
    path = tmp_path_factory.mktemp("wires") / "run.mcap"
    with rig() as (wires, _, _), connected(build_drivers(wires)) as instruments:
        logs = []

        def write_batch(batch):
            aligner.feed(batch)
            for one in logs:
                one.write_blocks(batch.instrument, batch.blocks)

        for name, instrument in instruments.items():
            instrument.add_listener(lambda frame, name=name: [one.write_frame(name, frame) for one in logs])
        acquisition = Acquisition(
            instruments, write_batch, pytest.fail, idle={"actuator": instruments["actuator"]}
        )
        aligner = Aligner(acquisition.maps, "coil_voltage")
        with contextlib.ExitStack() as stack:
            stack.callback(acquisition.stop)
            acquisition.start()
            wait_until(lambda: aligner.align() is not None, 20)
            recorder = stack.enter_context(LiveRecorder(path, HEADER, maps=acquisition.maps))
            logs.append(recorder)
            snapshots = {name: snapshot_decoder(instrument) for name, instrument in instruments.items()}
            recorder.attach(DECODERS_FILE, "application/json", orjson.dumps(snapshots))
            end = time.monotonic() + SECONDS

            def is_over():
                if (ready := aligner.align()) is not None:
                    recorder.write_samples(ready.time_ns, ready.columns)
                time.sleep(0.02)
                return time.monotonic() > end

            used = resource.getrusage(resource.RUSAGE_SELF)
            wait_until(is_over, SECONDS + 10)
            now = resource.getrusage(resource.RUSAGE_SELF)
            logs.clear()
            assert recorder.dropped_counts == {}
    cpu = (now.ru_utime - used.ru_utime + now.ru_stime - used.ru_stime) / SECONDS
    sys.stdout.write(f"agent {cpu:.1%} of a core, log {path.stat().st_size / SECONDS / 1e3:.0f} kB/s\n")
    return path


def test_every_instrument_gives_the_same_samples_bit_for_bit(log):
    results = {result.instrument: result for result in replay_frames(log)}
    assert set(results) == {"actuator", "load_cell", "lvdt", "coil_amplifier", "thermometer"}
    for result in results.values():
        sys.stdout.write(f"{result}\n")
        assert result.is_equal
    assert results["load_cell"].samples > 1000
    assert results["lvdt"].samples > 500


def test_messages_match_their_schemas(log):
    with log.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic.startswith(("/wire/", "/instrument/")):
                assert json.loads(schema.data) == make_message_schema(channel.topic)
                jsonschema.validate(json.loads(message.data), make_message_schema(channel.topic))


def test_the_log_is_read_as_any_other(log):
    content = read_log(log)
    assert content.outcome == "clean"
    assert {"force_raw", "actuator_position", "temperature"} <= set(content.samples)
    assert int(content.metadata["outcome"]["/wire/load_cell"]) > 0


def flip_character(log, out, topic):
    """Copy a log with one character of a frame of a topic changed."""
    with log.open("rb") as file, out.open("wb") as other:
        reader, writer = make_reader(file), Writer(other)
        writer.start("mrbench", "test")
        schemas, channels = {}, {}
        messages = list(reader.iter_messages(log_time_order=False))
        numbers = [n for n, (_, channel, _) in enumerate(messages) if channel.topic == topic]
        chosen = numbers[len(numbers) // 2]
        for number, (schema, channel, message) in enumerate(messages):
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, "json", schemas[schema.id])
            data = change_data(message.data) if number == chosen else message.data
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for document in reader.iter_attachments():
            writer.add_attachment(0, 0, document.name, document.media_type, document.data)
        writer.finish()


def change_data(data):
    content = json.loads(data)
    longest = max((n for n, sent in enumerate(content["sent"]) if not sent), key=lambda n: len(content["data"][n]))
    text = content["data"][longest]
    at = len(text) // 5  # among the samples, not in the empty part of a block
    content["data"][longest] = text[:at] + ("A" if text[at] != "A" else "B") + text[at + 1 :]
    return json.dumps(content).encode()


@pytest.mark.parametrize("name", ["load_cell", "lvdt", "coil_amplifier"])
def test_a_single_changed_byte_is_detected(log, tmp_path, name):
    other = tmp_path / "flipped.mcap"
    flip_character(log, other, f"/wire/{name}")
    results = {result.instrument: result for result in replay_frames(other)}
    assert results[name].differences > 0
    assert all(result.is_equal for result in results.values() if result.instrument != name)
