"""Log read by the independent reader ``@mcap/core``, compared with the reader of the bench."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bench.log.header import RunHeader
from bench.log.messages import MESSAGES, make_schema_name
from bench.log.reader import read_log
from bench.log.salvage import salvage_log
from bench.log.writer import LogWriter

FOLDER = Path(__file__).with_name("javascript")
NODE = shutil.which("node")

pytestmark = [
    pytest.mark.skipif(NODE is None, reason="Node is not installed; the independent reader @mcap/core needs it"),
    pytest.mark.skipif(
        not (FOLDER / "node_modules" / "@mcap" / "core").is_dir(),
        reason="@mcap/core is not installed; run `npm ci --prefix tests/system/javascript`",
    ),
]


def write_log(path):
    header = RunHeader(
        id="js", specimen="damper 7", method="sine", drive_kind="coil_a", drive_unit="A", source="run", seed=5
    )
    generator = np.random.default_rng(5)
    names = ("displacement", "velocity", "force", "coil_drive", "temperature")
    columns = {name: generator.normal(0, 100, 3000) for name in names}
    mark = {"index": 0, "name": "all", "stretch": "sine", "motion": "random", "drive": "constant"}
    time_ns = 1_700_000_000_123_456_789 + np.arange(3000, dtype=np.int64) * 1_000_003
    with LogWriter(path, header) as log:
        log.attach("method.json", "application/json", b"{}")
        log.write_segment(int(time_ns[0]), phase="start", **mark)
        log.write_samples(time_ns, columns)
        log.write_segment(int(time_ns[-1]), phase="end", **mark)
        log.write_event(int(time_ns[-1]), "state", "run finished")
    return path


def read_with_javascript(path):
    command = [str(NODE), str(FOLDER / "read_log.js"), str(path)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


@pytest.fixture(scope="module", params=["clean", "truncated"])
def both(request, tmp_path_factory):
    """Return one log as read by the bench and by the independent reader."""
    path = write_log(tmp_path_factory.mktemp("log") / "run.mcap")
    if request.param == "truncated":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        salvage_log(path)
    return read_log(path), read_with_javascript(path)


def test_every_message_is_counted(both):
    log, seen = both

    counted = {topic: str(seen["counts"].get(topic, 0)) for topic in MESSAGES}
    assert counted == {topic: log.metadata["outcome"][topic] for topic in MESSAGES}
    assert seen["counts"]["/bench/sample"] == len(log.samples["time"]) > 500


def test_values_are_bit_identical(both):
    log, seen = both

    for name in ("displacement", "velocity", "force", "coil_drive", "temperature"):
        np.testing.assert_array_equal([sample[name] for sample in seen["samples"]], log.samples[name])
    assert [int(sample["time_ns"]) for sample in seen["samples"]] == log.samples["time_ns"].tolist()


def test_schemas_have_their_names(both):
    assert both[1]["schemas"] == {
        topic: {"name": make_schema_name(topic), "encoding": "jsonschema", "message": "json"} for topic in MESSAGES
    }


def test_metadata_is_the_same(both):
    log, seen = both

    assert seen["profile"] == "mrbench"
    assert seen["metadata"] == log.metadata
    assert set(seen["attachments"]) == {"README.txt", "method.json"}
