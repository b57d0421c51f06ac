"""What a dry run asks of the identification, and what it does where nobody answers."""

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


def test_every_addition_keeps_the_methods_limits_and_is_a_segment_that_can_be_run(quick):
    found = make_candidate_strokes(quick)
    limits = quick.method.limits
    assert len(found) > 10
    for segment, alone in found:
        assert compute_envelope(alone).total.force_n <= limits.force_n
        assert np.abs(alone.displacement).max() <= limits.stroke_m
        longer = quick.method.model_copy(update={"segments": (*quick.method.segments, segment)})
        assert compile_method(longer).duration > quick.duration + 9


def test_additions_step_the_drive_inside_strokes_as_high_as_the_method_may(quick):
    steps = [alone for segment, alone in make_candidate_strokes(quick) if segment.drive.kind == "steps"]
    assert steps
    assert all(np.ptp(alone.drive) == quick.method.limits.drive for alone in steps)
    assert len(DRIVE_LEVELS) > 10


def test_a_method_without_room_for_a_force_gets_no_additions_beyond_it(quick):
    tight = quick.method.limits.model_copy(update={"force_n": 650.0})
    programme = compile_method(quick.method.model_copy(update={"limits": tight}))
    assert 0 < len(make_candidate_strokes(programme)) < len(make_candidate_strokes(quick))


def test_planned_samples_are_those_of_the_programme(quick, tmp_path):
    write_planned_strokes(tmp_path / "planned.npz", quick)
    with np.load(tmp_path / "planned.npz") as file:
        info = json.loads(str(file["info"]))
        np.testing.assert_array_equal(file["plan"][0], quick.displacement)
        np.testing.assert_array_equal(file["plan"][3], quick.drive)
        assert file[f"addition_{len(info['additions']) - 1}"].shape[0] == 4
    assert info["method"] == "quick"
    assert info["drive_unit"] == "V"


def test_samples_that_cannot_be_written_are_said(quick, tmp_path):
    with pytest.raises(RunError, match="cannot be written"):
        write_planned_strokes(tmp_path / "none" / "planned.npz", quick)


def says(text, code=0):
    """A command that prints a text to the right place and ends."""
    stream = "stderr" if code else "stdout"
    return (sys.executable, "-c", f"import sys; sys.{stream}.write({text!r}); sys.exit({code})")


def test_the_answer_is_the_document_that_was_printed(quick):
    assert assess_design(quick, command=says('{"words": ["all of it"]}')) == {"words": ["all of it"]}


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (says("mrbench: numba is not installed", 1), "is not known: numba is not installed"),
        (says("no json"), "is no JSON"),
        (("/no/such/command",), "is not known"),
    ],
)
def test_where_nobody_answers_it_is_said(quick, command, why):
    with pytest.raises(RunError, match=why):
        assess_design(quick, command=command)
