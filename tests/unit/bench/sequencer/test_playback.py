"""Split of a programme into sections, and the samples at which a run can be paused."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from bench.errors import RunError
from bench.methods import Programme
from bench.sequencer.playback import (
    PlaybackSection,
    find_checkpoint_samples,
    find_rest_samples,
    split_into_sections,
)
from tests.support.methods import constant, hold, programme, sine

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


def test_programme_can_be_paused_at_rest_after_each_checkpoint_but_the_last():
    ((sample, name),) = find_checkpoint_samples(TWO_SEGMENTS).items()
    assert name == "a"
    assert TWO_SEGMENTS.segments[0].stop <= sample <= TWO_SEGMENTS.segments[1].start
    assert abs(TWO_SEGMENTS.velocity[sample]) < 1e-6
    assert [section.stop for section in split_into_sections(TWO_SEGMENTS, 1024)] == [
        sample,
        len(TWO_SEGMENTS.time) - 1,
    ]


def make_programme(rate=10.0, velocity=None, segment=None, segments=()):
    """Return 13 samples at rest at every fourth, with drive levels 0 to 3 that begin at 0, 2, 5 and 9."""
    velocity = np.where(np.arange(13) % 4, 0.1, 0.0) if velocity is None else np.array(velocity)
    segment = np.full(13, -1) if segment is None else np.array(segment)
    drive = np.array([0, 0, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3.0])
    zero = np.zeros(13)
    method = SimpleNamespace(name="m")
    return Programme(method, rate, np.arange(13) / rate, zero, velocity, zero, drive, segment, segments)


@pytest.mark.parametrize(("capacity", "stops"), [(2, [4, 8, 12]), (3, [8, 12]), (4, [12])])
def test_table_holds_the_level_at_the_begin_and_each_change(capacity, stops):
    assert [section.stop for section in split_into_sections(make_programme(), capacity)] == stops


def test_section_with_more_levels_than_the_table_is_refused():
    with pytest.raises(RunError, match=r"from 0.0 s on: the drive takes 2 values .* table holds 1; shorten"):
        split_into_sections(make_programme(), 1)


@pytest.mark.parametrize(
    ("interval_s", "stops"),
    [(5.0, [12]), (7.5, [8, 12]), (7.6, [4, 8, 12]), (15.0, [4, 8, 12]), (20.0, [4, 8, 12])],
)
def test_section_lasts_a_minute_at_most_if_the_programme_rests(interval_s, stops):
    assert [section.stop for section in split_into_sections(make_programme(1 / interval_s), 9)] == stops


def test_section_has_its_own_time_and_drive_steps():
    section = PlaybackSection(make_programme(), 4, 12)
    assert section.trajectory.duration == pytest.approx(0.8)
    times, levels = section.list_drive_steps()
    assert (times.tolist(), levels.tolist()) == ([0.0, 0.1, 0.5], [1.0, 2.0, 3.0])


def test_sample_in_force_is_the_last_one_with_a_margin_for_rounding():
    section = PlaybackSection(make_programme(), 4, 8)
    time = np.array([-1.0, 0.0, 0.0999, 0.099_999_95, 0.1, 0.39, 0.4, 9.0])
    assert section.find_samples(time).tolist() == [4, 4, 4, 5, 5, 7, 8, 8]


def test_programme_is_at_rest_below_a_micrometre_per_second():
    velocity = [0, 1e-6, 0.99e-6, -1e-6, -0.99e-6, *[0.1] * 8]
    assert find_rest_samples(make_programme(velocity=velocity)).tolist() == [0, 2, 4, 12]


def test_run_waits_between_segments_or_at_their_edges():
    segment = [-1, 0, 0, 0, 1, 1, -1, -1, 1, 1, 1, 1, 1]
    assert find_rest_samples(make_programme(velocity=np.zeros(13), segment=segment)).tolist() == [
        0,
        1,
        4,
        6,
        7,
        8,
        12,
    ]


def test_programme_is_split_where_the_shunt_is_switched():
    rests = programme(hold("a", 0.2), hold("b", 0.3, shunt=True), hold("c", 0.2, shunt=True), hold("d", 0.2))
    sections = split_into_sections(rests, 1024)
    assert [(one.start, one.stop, one.shunt) for one in sections] == [
        (0, 200, False), (200, 500, True), (500, 700, True), (700, 900, False)
    ]  # fmt: skip
    assert [one.duration for one in sections] == pytest.approx([0.2, 0.3, 0.2, 0.2])


def test_programme_may_begin_and_end_with_the_shunt():
    (section,) = split_into_sections(programme(hold("a", 0.5, shunt=True)), 1024)
    assert (section.start, section.stop, section.shunt) == (0, 500, True)
