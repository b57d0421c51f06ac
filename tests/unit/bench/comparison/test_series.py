"""Series of a simulation, and its error on each segment."""

import json

import numpy as np
import pytest

from bench.comparison import find_stroke_errors, read_force_series
from bench.errors import LogError
from bench.samples import SampleStore
from tests.support.cyclic_logs import write_cyclic_log


def write_series(path, time, force, error, **more):
    zeros = np.zeros(len(time))
    columns = {
        "displacement": zeros,
        "velocity": zeros,
        "drive": zeros,
        "force": force,
        "simulated": force + error,
    }
    info = json.dumps({"stretches": ["quick"], "drive_unit": "V"})
    held_out = np.arange(len(time)) >= len(time) // 2
    np.savez(path, time=time, info=np.array(info), held_out=held_out, stretch=zeros, **columns, **more)


def test_each_segment_has_its_own_error(tmp_path):
    table = SampleStore(tmp_path).load(write_cyclic_log(tmp_path / "a.mcap"), None)
    force = table.columns["force"].astype(float)
    error = np.where(np.arange(len(force)) < len(force) // 2, 3.0, -1.0)
    write_series(tmp_path / "s.npz", table.time, force, error, lower=force - 4, upper=force + 4)
    series = read_force_series(tmp_path / "s.npz")
    first, second = find_stroke_errors(series, table.segments)
    assert (first.segment, first.rmse_n, first.bias_n) == ("0.1V", pytest.approx(3.0), pytest.approx(3.0))
    assert (first.samples, first.held_out, second.held_out) == (1000, False, True)
    assert second.bias_n == pytest.approx(-1.0)
    np.testing.assert_allclose(series.half_width, 4.0)


def test_a_series_without_band_has_no_width(tmp_path):
    write_series(tmp_path / "s.npz", np.arange(5.0), np.zeros(5), 1.0)
    assert read_force_series(tmp_path / "s.npz").half_width is None


@pytest.mark.parametrize("content", [None, b"PK", b"text"])
def test_another_file_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "s.npz").write_bytes(content)
    with pytest.raises(LogError, match="not a series"):
        read_force_series(tmp_path / "s.npz")
