"""Interpolation, true values and faults of channels, computed by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

from sim_rig.scenario import ChannelFault
from sim_rig.sensors.channels import compute_true_values, read_channel
from sim_rig.sensors.faults import apply_channel_faults
from sim_rig.sensors.sampling import (
    ResponseStream,
    apply_filter,
    design_low_pass,
    interpolate_cubic,
    sample_held,
)

CUBE = np.arange(6.0) ** 3


@pytest.mark.parametrize("first", [0, 10])
@pytest.mark.parametrize(
    ("position", "value"),
    [(0.0, 0.0), (0.5, 0.125), (1.0, 1.0), (1.5, 3.375), (2.25, 11.390625), (4.5, 91.125), (9.0, 125.0)],
)
def test_cubic_is_interpolated_exactly_and_held_beyond_its_end(first, position, value):
    instants = np.array([(first + position) * 0.1])
    assert interpolate_cubic(CUBE, 0.1, instants, first) == pytest.approx([value], abs=1e-9)


def test_interpolated_signal_is_constant_before_time_zero():
    assert interpolate_cubic(CUBE + 7.0, 0.1, np.array([-0.3])) == pytest.approx([7.0])


def test_held_signal_is_read_half_way_between_its_updates():
    instants = np.array([-1.0, 0.04, 0.06, 0.14, 0.16, 9.0])
    assert sample_held(CUBE[:3], 0.1, instants).tolist() == [0, 0, 1, 1, 8, 8]
    assert sample_held(CUBE[:3], 0.1, instants + 1.0, first=10).tolist() == [0, 0, 1, 1, 8, 8]


def test_a_channel_holds_each_reading_until_the_next():
    class Stream:
        rate = 10.0

        def feed(self, values):
            self.values = values

        def make_readings(self, count):
            return np.arange(count) / self.rate, self.values[:count]

    time = np.array([0.0, 0.05, 0.0999, 0.1, 0.3 - 1e-9, 0.31])
    assert read_channel(Stream(), CUBE, time).tolist() == [0, 0, 0, 1, 27, 27]


@pytest.mark.parametrize(("unit", "current", "voltage"), [("V", 0.4, 2.0), ("A", 2.0, 10.0)])
def test_current_and_voltage_of_the_coil_follow_from_its_resistance(varied, unit, current, voltage):
    changes = {} if unit == "V" else {"drive_unit": "A", "drive_kind": "coil_a", "damper": "lord_class"}
    truth = SimpleNamespace(
        output=np.array([2.0]),
        position=np.array([0.01, 0.02]),
        force=np.array([3.0, 4.0]),
        temperature=np.array([22.0]),
    )
    found = compute_true_values(varied(**changes), truth, 0.0, 1e-3)
    assert (found["coil_current"].tolist(), found["coil_voltage"].tolist()) == ([current], [voltage])
    assert found["coil_drive"].tolist() == [2.0]
    assert found["force"].tolist() == [3.0, 4.0]
    assert found["displacement"] == pytest.approx([0.01, 0.02])


@pytest.mark.parametrize(
    ("kind", "start", "expected"),
    [("stuck", 2.0, [1, 2, 2, 2, 5]), ("stuck", 0.0, [9, 9, 3, 4, 5]), ("missing", 2.0, [1, 2, None, None, 5])],
)
def test_fault_lasts_from_its_start_up_to_its_end(kind, start, expected):
    fault = ChannelFault(kind=kind, channel="force", start=start, duration=2.0)
    found = apply_channel_faults([fault], np.arange(5.0), np.array([1.0, 2, 3, 4, 5]), 9.0)
    assert [None if np.isnan(value) else value for value in found] == expected


def test_a_filter_in_parts_has_the_output_of_scipy():
    b, a = signal.butter(3, 0.1)
    values = np.random.default_rng(1).standard_normal(50)
    state = signal.lfilter_zi(b, a) * values[0]
    expected, _ = signal.lfilter(b, a, values, zi=state)
    parts = [apply_filter(b, a, part, state) for part in (values[:7], values[7:8], values[8:])]
    assert np.concatenate(parts) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("order", [1, 2, 4])
@pytest.mark.parametrize("share", [0.04, 0.3])
def test_a_low_pass_has_the_coefficients_of_scipy(order, share):
    analogue = signal.butter(order, 2 * np.pi * share * 1e3, analog=True)
    numerator, denominator, _ = signal.cont2discrete(analogue, 1e-3, method="foh")
    b, a = design_low_pass(order, share * 1e3, 1e-3)
    assert b == pytest.approx(np.ravel(numerator), abs=1e-12)
    assert a == pytest.approx(denominator, abs=1e-12)


def test_a_step_response_does_not_depend_on_the_division_into_chunks():
    weights, values = np.array([0.1, 0.2, 0.4, 0.3]), CUBE + 5.0
    expected = [sum(w * values[max(i - k, 0)] for k, w in enumerate(weights)) for i in range(6)]
    for edges in ((6,), (1, 2, 6), (1, 2, 3, 4, 5, 6), (3, 3, 6)):
        stream, first = ResponseStream(weights), 0
        found = []
        for edge in edges:
            found += stream.feed(values[first:edge]).tolist()
            first = edge
        assert found == pytest.approx(expected)


def test_a_step_response_of_one_weight_is_a_gain():
    assert ResponseStream(np.array([0.5])).feed(CUBE).tolist() == (0.5 * CUBE).tolist()
