"""The dry run: peaks, the force to expect, the verdict."""

import json

import numpy as np
import pytest

from bench.errors import MethodError
from bench.methods import compile_method, load_method
from bench.methods.envelope import envelope, envelope_lines


@pytest.fixture(scope="module")
def quick():
    return compile_method(load_method("quick"))


def with_limits(programme, **limits):
    method = programme.method
    changed = method.limits.model_copy(update=limits)
    return compile_method(method.model_copy(update={"limits": changed}))


def test_the_whole_is_as_large_as_its_largest_part(quick):
    found = envelope(quick)
    for peak in ("displacement_m", "velocity_mps", "force_n", "drive"):
        assert getattr(found.whole, peak) == max(getattr(one, peak) for one in found.segments)
    assert found.whole.duration_s == quick.duration


def test_peaks_of_a_sine_are_those_of_the_formula(quick):
    first = envelope(quick).segments[0]
    assert first.name == "10mm_1Hz_0.3V"
    assert first.velocity_mps == pytest.approx(0.01 * 2 * np.pi)
    assert first.acceleration_mps2 == pytest.approx(0.01 * (2 * np.pi) ** 2)


def test_the_expected_force_grows_with_the_drive(quick):
    by_drive = {one.drive: one.force_n for one in envelope(quick).segments[:6]}
    forces = [by_drive[drive] for drive in sorted(by_drive)]
    assert forces == sorted(forces)
    assert forces[0] == pytest.approx(111, abs=2)


def test_a_force_above_its_limit_is_said_and_not_raised(quick):
    assert envelope(quick).verdict == "within limits"
    assert envelope(with_limits(quick, force_n=300.0)).verdict == "force limit exceeded"


def test_the_table_has_a_line_for_each_segment_and_ends_with_the_verdict(quick):
    found = envelope(quick)
    lines = envelope_lines(found)
    assert len(lines) == 2 + len(found.segments) + 3
    assert lines[-1].startswith("within limits; ")
    assert len({len(line) for line in lines[:-1]}) == 1


def test_the_envelope_is_json_with_its_schema_named(quick):
    content = json.loads(envelope(quick).model_dump_json(by_alias=True))
    assert content["schema"] == "mrbench.envelope/1"
    assert content["samples"] == len(quick.time)


def test_a_current_driven_method_is_expected_on_a_current_driven_damper(quick):
    method = quick.method.model_copy(update={"drive_kind": "coil_a"})
    assert envelope(compile_method(method)).damper == "lord_class"


def test_an_unknown_damper_is_answered_with_those_that_exist(quick):
    with pytest.raises(MethodError, match="no damper gone to expect a force of; there are laboratory, "):
        envelope(quick, "gone")


def test_a_damper_of_another_drive_is_refused(quick):
    with pytest.raises(MethodError, match="lord_class is driven in A, the method in V"):
        envelope(quick, "lord_class")
