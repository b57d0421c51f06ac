"""Commands of a run by bench time."""

import math

import numpy as np
import pytest

from bench.methods.compile import NO_SEGMENT
from bench.sequencer.command_history import CommandEntry, CommandHistory
from bench.sequencer.playback import split_into_sections
from bench.sequencer.setpoint_thread import SetpointGenerator
from bench.sequencer.trajectory import ScheduledTrajectory, make_standstill, plan_approach
from tests.support.fake_rig import CYCLE, FakeActuator, step_cycles
from tests.support.methods import constant, programme, sine

TWO_SEGMENTS = programme(sine("a", 0.01, 2.0, constant(0.2)), sine("b", 0.005, 4.0, constant(0.4)))
(SECTION,) = split_into_sections(TWO_SEGMENTS, 1024)


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
