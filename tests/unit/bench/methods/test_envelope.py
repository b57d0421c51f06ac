"""Dry run: peaks, expected force and verdict."""

import json

import numpy as np
import pytest

from bench.errors import MethodError
from bench.methods import compile_method, load_method
from bench.methods.envelope import compute_envelope, format_envelope


@pytest.fixture(scope="module")
def quick():
    return compile_method(load_method("quick"))


def with_limits(programme, **limits):
    method = programme.method
    changed = method.limits.model_copy(update=limits)
    return compile_method(method.model_copy(update={"limits": changed}))


def test_the_peaks_of_the_programme_are_the_largest_of_its_segments(quick):
    envelope = compute_envelope(quick)
    for peak in ("displacement_m", "velocity_mps", "force_n", "drive"):
        assert getattr(envelope.total, peak) == max(getattr(segment, peak) for segment in envelope.segments)
    assert envelope.total.duration_s == quick.duration


def test_peaks_of_a_sine_are_those_of_the_formula(quick):
    first = compute_envelope(quick).segments[0]
    assert first.name == "10mm_1Hz_0.3V"
    assert first.velocity_mps == pytest.approx(0.01 * 2 * np.pi)
    assert first.acceleration_mps2 == pytest.approx(0.01 * (2 * np.pi) ** 2)


def test_the_expected_force_grows_with_the_drive(quick):
    by_drive = {peaks.drive: peaks.force_n for peaks in compute_envelope(quick).segments[:6]}
    forces = [by_drive[drive] for drive in sorted(by_drive)]
    assert forces == sorted(forces)
    assert forces[0] == pytest.approx(111, abs=2)


def test_a_force_above_its_limit_is_a_verdict_and_not_an_error(quick):
    assert compute_envelope(quick).verdict == "within limits"
    assert compute_envelope(with_limits(quick, force_n=300.0)).verdict == "force limit exceeded"


def test_the_table_has_a_line_for_each_segment_and_ends_with_the_verdict(quick):
    envelope = compute_envelope(quick)
    lines = format_envelope(envelope)
    assert len(lines) == 2 + len(envelope.segments) + 3
    assert lines[-1].startswith("within limits; ")
    assert len({len(line) for line in lines[:-1]}) == 1


def test_the_envelope_is_json_with_its_schema_named(quick):
    content = json.loads(compute_envelope(quick).model_dump_json(by_alias=True))
    assert content["schema"] == "mrbench.envelope/1"
    assert content["samples"] == len(quick.time)


def test_the_default_damper_of_a_current_driven_method_is_current_driven(quick):
    method = quick.method.model_copy(update={"drive_kind": "coil_a"})
    assert compute_envelope(compile_method(method)).damper == "lord_class"


def test_message_on_an_unknown_damper_lists_the_dampers(quick):
    with pytest.raises(MethodError, match="there is no damper gone; the dampers are laboratory, "):
        compute_envelope(quick, "gone")


def test_a_damper_with_another_drive_unit_is_refused(quick):
    with pytest.raises(MethodError, match="the drive of damper lord_class is in A, that of the method in V"):
        compute_envelope(quick, "lord_class")
