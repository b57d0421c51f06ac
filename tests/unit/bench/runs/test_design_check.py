"""Assessment of planned strokes: file for the identification, its document, and its failures."""

import json
import sys

import numpy as np
import pytest

from bench.errors import RunError
from bench.methods import compile_method, load_method
from bench.methods.candidate_strokes import DRIVE_LEVELS, make_candidate_strokes
from bench.methods.envelope import compute_envelope
from bench.runs.design_check import assess_design, write_planned_strokes


@pytest.fixture(scope="module")
def quick():
    return compile_method(load_method("quick"))


def test_candidate_strokes_are_valid_segments_within_the_limits_of_the_method(quick):
    found = make_candidate_strokes(quick)
    limits = quick.method.limits
    assert len(found) > 10
    for segment, alone in found:
        assert compute_envelope(alone).total.force_n <= limits.force_n
        assert np.abs(alone.displacement).max() <= limits.stroke_m
        longer = quick.method.model_copy(update={"segments": (*quick.method.segments, segment)})
        assert compile_method(longer).duration > quick.duration + 9


def test_stepped_candidate_strokes_use_the_whole_range_of_the_drive(quick):
    steps = [alone for segment, alone in make_candidate_strokes(quick) if segment.drive.kind == "steps"]
    assert steps
    assert all(np.ptp(alone.drive) == quick.method.limits.drive for alone in steps)
    assert len(DRIVE_LEVELS) > 10


def test_lower_force_limit_leaves_fewer_candidate_strokes(quick):
    tight = quick.method.limits.model_copy(update={"force_n": 650.0})
    programme = compile_method(quick.method.model_copy(update={"limits": tight}))
    assert 0 < len(make_candidate_strokes(programme)) < len(make_candidate_strokes(quick))


def test_planned_samples_equal_those_of_the_programme(quick, tmp_path):
    write_planned_strokes(tmp_path / "planned.npz", quick)
    with np.load(tmp_path / "planned.npz") as file:
        info = json.loads(str(file["info"]))
        np.testing.assert_array_equal(file["plan"][0], quick.displacement)
        np.testing.assert_array_equal(file["plan"][3], quick.drive)
        assert file[f"addition_{len(info['additions']) - 1}"].shape[0] == 4
    assert info["method"] == "quick"
    assert info["drive_unit"] == "V"


def test_file_that_cannot_be_written_is_an_error(quick, tmp_path):
    with pytest.raises(RunError, match="cannot be written"):
        write_planned_strokes(tmp_path / "none" / "planned.npz", quick)


def make_command(text, code=0):
    """Return a command that prints a text and ends; a failure prints to standard error."""
    stream = "stderr" if code else "stdout"
    return (sys.executable, "-c", f"import sys; sys.{stream}.write({text!r}); sys.exit({code})")


def test_printed_document_is_returned(quick):
    assert assess_design(quick, command=make_command('{"coordinates": ["c0"]}')) == {"coordinates": ["c0"]}


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (make_command("mrbench: numba is not installed", 1), "were not assessed: numba is not installed"),
        (make_command("not a document"), "is not JSON"),
        (("/no/such/command",), "were not assessed"),
    ],
)
def test_failed_assessment_is_an_error(quick, command, message):
    with pytest.raises(RunError, match=message):
        assess_design(quick, command=command)
