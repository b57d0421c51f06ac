"""Description of the devices' clocks in the log."""

import tomllib
from datetime import UTC, datetime
from types import SimpleNamespace

import orjson

from bench.config import BenchConfig
from bench.log import Identity
from bench.methods import load_method
from bench.recorder.bench_header import describe_clocks, make_run_header
from bench.rig.instruments import build_rig
from tests.support.fake_rig import BENCH_TOML


def make_rig(*names):
    channels = [SimpleNamespace(name="force"), SimpleNamespace(name="force_raw")]
    instruments = [SimpleNamespace(name=name, instrument=SimpleNamespace(channels=channels)) for name in names]
    return SimpleNamespace(instruments=instruments)


def test_clocks_are_described_in_ppm_and_seconds():
    known = SimpleNamespace(
        is_known=True,
        estimate_rate=lambda: -47.12345e-6,
        map_instants=lambda device_ns: device_ns + 2_500_000_000,
        compute_error_bound=lambda: 3e-4,
    )
    unknown = SimpleNamespace(is_known=False)
    described = describe_clocks(make_rig("cell", "ascii"), {"cell": known, "ascii": unknown})
    names = {"channels": ["force", "force_raw"]}
    assert orjson.loads(described["cell"]) == names | {
        "ppm": -47.123, "offset_s": 2.5, "clock_error_bound_s": 3e-4
    }  # fmt: skip
    assert orjson.loads(described["ascii"]) == names | {"ppm": None, "offset_s": None, "clock_error_bound_s": None}


def test_utc_offset_is_the_time_at_which_the_bench_clock_was_zero():
    """The bench clock showed 90.5 s at 12:00:00."""
    identity = Identity("D1", "", datetime(2026, 1, 2, 12, 0, 0, tzinfo=UTC))
    config = BenchConfig.model_validate(tomllib.loads(BENCH_TOML))
    rig = build_rig(config, lambda: 0, realtime=True)
    maps = {one.name: SimpleNamespace(is_known=False) for one in rig.instruments}
    header = make_run_header(load_method("quick"), identity, config, rig, maps, 90_500_000_000)
    assert header.utc_offset == "2026-01-02T11:58:29.500000+00:00"
    assert header.drive_unit == rig.drive_unit
