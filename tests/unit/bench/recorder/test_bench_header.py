"""Description of the devices' clocks in the log."""

from types import SimpleNamespace

import orjson

from bench.recorder.bench_header import describe_clocks


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
