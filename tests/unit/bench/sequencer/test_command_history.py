"""Commands of a run by bench time."""

import math

import numpy as np
import pytest

from bench.methods.compile import NO_SEGMENT
from bench.sequencer.command_history import CommandEntry, CommandHistory
from bench.sequencer.playback import PlaybackSection
from bench.sequencer.setpoint_thread import SetpointGenerator
from bench.sequencer.trajectory import ScheduledTrajectory, make_standstill, plan_approach
from tests.support.fake_rig import CYCLE, FakeActuator, step_cycles
from tests.support.methods import constant, programme, sine

TWO_SEGMENTS = programme(sine("a", 0.01, 2.0, constant(0.2)), sine("b", 0.005, 4.0, constant(0.4)))
SECTION = PlaybackSection(TWO_SEGMENTS, 0, len(TWO_SEGMENTS.time) - 1)


@pytest.fixture
def history():
    return CommandHistory()


@pytest.fixture
def generator(history):
    return SetpointGenerator(FakeActuator(), lambda position: None, history, CYCLE, 0.05)


def test_commands_are_those_of_the_programme(generator, history):
    generator.start(SECTION.trajectory, SECTION)
    step_cycles(generator, 500, 1100)
    commands = history.find_commands(500 + np.round(TWO_SEGMENTS.time * 1e9).astype(np.int64))
    assert np.allclose(commands.displacement, TWO_SEGMENTS.displacement, rtol=0, atol=1e-12)
    assert np.array_equal(commands.drive, TWO_SEGMENTS.drive)
    assert np.array_equal(commands.segment[:-1], TWO_SEGMENTS.segment[:-1])
    assert np.isnan(history.find_commands(np.array([499])).displacement).all()


def test_after_a_stop_the_coil_is_off_and_no_segment_continues(generator, history):
    generator.start(SECTION.trajectory, SECTION)
    now = step_cycles(generator, 0, 200)
    history.switch_off(now)
    generator.stop(now, 8.0)
    commands = history.find_commands(np.array([now - 1, now, now + 10_000_000_000]))
    assert commands.drive.tolist() == [0.2, 0.0, 0.0]
    assert commands.segment.tolist() == [0, NO_SEGMENT, NO_SEGMENT]
    assert commands.displacement[2] == pytest.approx(generator.schedule.find_position(now + 20_000_000_000))
    assert not history.has_reached(TWO_SEGMENTS.segments[0].stop, now)
    assert history.has_reached(TWO_SEGMENTS.segments[0].start, now)


def test_progress_and_due_samples_follow_the_bench_clock(history):
    begin = 7_000_000_000
    assert not history.has_reached(0, begin)
    assert history.find_progress(begin) == (0.0, NO_SEGMENT)
    history.add(CommandEntry(ScheduledTrajectory(plan_approach(0.0, 0.001), begin - 1_000_000_000)))
    assert not history.has_started
    history.add(CommandEntry(ScheduledTrajectory(SECTION.trajectory, begin), SECTION))
    assert history.has_started
    sample = TWO_SEGMENTS.segments[1].start
    due = begin + round(TWO_SEGMENTS.time[sample] * 1e9)
    assert not history.has_reached(sample, due - 2_000_000)
    assert history.has_reached(sample, due)
    assert not history.has_reached(0, begin - 1)
    assert history.find_progress(due) == (pytest.approx(TWO_SEGMENTS.time[sample]), 1)
    history.switch_off(due)
    assert history.find_progress(due) == (pytest.approx(TWO_SEGMENTS.time[sample]), NO_SEGMENT)


def test_stopped_section_replaces_itself(history):
    schedule = ScheduledTrajectory(SECTION.trajectory, 1000)
    history.add(CommandEntry(schedule, SECTION))
    history.add(CommandEntry(schedule.add_soft_stop(500_000_000, 8.0), SECTION))
    assert [entry.schedule.soft_stop is not None for entry in history.entries] == [True]


def test_commanded_position_is_unknown_before_the_first_setpoint(history):
    assert math.isnan(history.find_position(0))
    history.add(CommandEntry(ScheduledTrajectory(make_standstill(0.003), 10)))
    assert math.isnan(history.find_position(9))
    assert history.find_position(10) == 0.003


SECOND = 1_000_000_000


@pytest.fixture
def two_entries(history):
    """Return a history with a standstill from 1 s and the programme from 2 s on, which lasts several seconds."""
    history.add(CommandEntry(ScheduledTrajectory(make_standstill(0.03), SECOND)))
    history.add(CommandEntry(ScheduledTrajectory(SECTION.trajectory, 2 * SECOND), SECTION))
    return history


def test_entry_applies_from_its_begin_to_that_of_the_next(two_entries):
    instants = np.array([SECOND - 1, SECOND, 2 * SECOND - 1, 2 * SECOND, 2 * SECOND + 250_000_000])
    expected = [math.nan, 0.03, 0.03, 0.0, TWO_SEGMENTS.displacement[250]]
    assert two_entries.find_commands(instants).displacement == pytest.approx(expected, nan_ok=True)
    assert [two_entries.find_position(int(one)) for one in instants] == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(("sample", "at_ns", "has_reached"), [
    (0, 2 * SECOND - 1, False), (0, 2 * SECOND, True), (100, 2_099_000_000, False), (100, 2_100_000_000, True),
])  # fmt: skip
def test_sample_is_reached_at_its_time(two_entries, sample, at_ns, has_reached):
    assert two_entries.has_reached(sample, at_ns) is has_reached


def test_progress_ends_with_the_drive(two_entries):
    inside = TWO_SEGMENTS.segments[1].start + 10
    at_ns = 2 * SECOND + inside * 1_000_000
    assert two_entries.find_progress(at_ns) == (pytest.approx(inside / 1000), 1)
    two_entries.switch_off(at_ns)
    two_entries.switch_off(at_ns + 5)  # only the first call counts
    assert two_entries.find_progress(at_ns - 1)[1] == 1
    assert two_entries.find_progress(at_ns)[1] == NO_SEGMENT
    commands = two_entries.find_commands(np.array([at_ns - 1, at_ns]))
    assert (commands.drive.tolist(), commands.segment.tolist()) == ([0.4, 0.0], [1, NO_SEGMENT])


def test_segment_ends_with_its_section(two_entries):
    end_ns = 2 * SECOND + round(SECTION.trajectory.duration * 1e9)
    assert two_entries.find_commands(np.array([end_ns])).segment.tolist() == [NO_SEGMENT]


def test_entry_with_the_begin_of_the_last_one_replaces_it(two_entries):
    stopped = two_entries.entries[-1].schedule.add_soft_stop(3 * SECOND, 8.0)
    two_entries.add(CommandEntry(stopped, SECTION))
    assert [entry.schedule for entry in two_entries.entries[1:]] == [stopped]
