"""Split of a programme into sections, and the sample from which an interrupted run continues."""

import itertools

import numpy as np
import pytest

from bench.errors import RunError
from bench.sequencer.playback import find_resume_sample, split_into_sections
from tests.support.methods import constant, programme, sine

TWO_SEGMENTS = programme(sine("a", 0.01, 2.0, constant(0.2)), sine("b", 0.005, 4.0, constant(0.4)))


def many_steps(count):
    times = [0.02 * index for index in range(count)]
    return {"kind": "steps", "time_s": times, "values": [0.1 * (index % 3) for index in range(count)]}


def test_programme_with_more_steps_than_the_table_is_split_at_rest():
    many = programme(*(sine(f"s{index}", 0.005, 1.0, many_steps(40)) for index in range(4)))
    sections = split_into_sections(many, 100)
    assert len(sections) > 1
    assert (sections[0].start, sections[-1].stop) == (0, len(many.time) - 1)
    assert all(first.stop == second.start for first, second in itertools.pairwise(sections))
    for section in sections:
        times, levels = section.list_drive_steps()
        assert len(times) <= 100
        assert abs(many.velocity[section.start]) < 1e-6
        elapsed = np.arange(section.stop - section.start) / many.rate + 1e-9
        step = np.searchsorted(times, elapsed, side="right") - 1
        assert np.array_equal(levels[step], many.drive[section.start : section.stop])


def test_long_programme_is_split_so_that_the_clocks_start_together_again():
    long = programme(*(sine(f"s{index}", 0.005, 0.1, constant(0.1)) for index in range(4)))
    sections = split_into_sections(long, 1024)
    assert len(sections) > 1
    assert all((section.stop - section.start) / long.rate <= 60.0 for section in sections)


def test_drive_with_too_many_steps_is_refused():
    ramp = programme(sine("swept", 0.005, 1.0, {"kind": "ramp", "start": 0.0, "end": 0.5}))
    with pytest.raises(RunError, match=r"segment swept: the drive takes \d{4} values .* holds 1024; shorten"):
        split_into_sections(ramp, 1024)


def test_interrupted_run_continues_at_rest_after_a_checkpoint():
    first = find_resume_sample(TWO_SEGMENTS, "a")
    assert TWO_SEGMENTS.segments[0].stop <= first <= TWO_SEGMENTS.segments[1].start
    assert abs(TWO_SEGMENTS.velocity[first]) < 1e-6
    assert split_into_sections(TWO_SEGMENTS, 1024, first)[0].start == first
    with pytest.raises(RunError, match="its checkpoints: a, b"):
        find_resume_sample(TWO_SEGMENTS, "c")
    with pytest.raises(RunError, match="has no segment after b; the run was complete"):
        find_resume_sample(TWO_SEGMENTS, "b")
