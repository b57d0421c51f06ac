"""Segment marks, checkpoints and commands among the samples of a run."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.recorder.run_recorder import RunRecorder
from bench.sequencer.command_history import CommandEntry, CommandHistory
from bench.sequencer.playback import PlaybackSection
from bench.sequencer.trajectory import ScheduledTrajectory
from tests.support.fake_rig import EventLog
from tests.support.methods import constant, programme, sine

MS = 1_000_000
BEGIN = 1_000 * MS
TWO_SEGMENTS = programme(sine("a", 0.01, 2.0, constant(0.2)), sine("b", 0.005, 4.0, constant(0.4)))
SECTION = PlaybackSection(TWO_SEGMENTS, 0, len(TWO_SEGMENTS.time) - 1)


class FakeLog:
    """Log that keeps its content in order: number of samples, and segment marks."""

    def __init__(self):
        self.content = []

    def write_samples(self, time_ns, values):
        self.content.append(len(time_ns))

    def write_segment(self, time_ns, **mark):
        self.content.append((mark["name"], mark["phase"], time_ns))


@pytest.fixture
def recording():
    history, log, events = CommandHistory(), FakeLog(), EventLog()
    history.add(CommandEntry(ScheduledTrajectory(SECTION.trajectory, BEGIN), SECTION))
    recorder = RunRecorder(log, TWO_SEGMENTS, history, events, begin_ns=BEGIN - 10 * MS)
    return SimpleNamespace(recorder=recorder, history=history, log=log, events=events)


def make_samples(start_ms, stop_ms):
    time_ns = np.arange(start_ms, stop_ms, dtype=np.int64) * MS
    return SimpleNamespace(time_ns=time_ns, columns={"force": np.zeros(len(time_ns))})


def find_segment_times(segment):
    times = TWO_SEGMENTS.time[[segment.start, segment.stop - 1]]
    return [BEGIN + round(time * 1e9) for time in times]


@pytest.mark.parametrize("size", [100, 130, 10_000])
def test_marks_are_between_the_samples_of_their_segments(recording, size):
    """With batches of 100 samples, segment a begins with the first sample of a batch."""
    stop = 1_000 + round(1e3 * TWO_SEGMENTS.duration) + 100
    for start in range(900, stop, size):
        recording.recorder.add_samples(make_samples(start, min(start + size, stop)))
    marks = [entry for entry in recording.log.content if isinstance(entry, tuple)]
    first, second = TWO_SEGMENTS.segments
    (a_start, a_end), (b_start, b_end) = find_segment_times(first), find_segment_times(second)
    assert marks == [
        ("a", "start", a_start), ("a", "end", a_end), ("b", "start", b_start), ("b", "end", b_end)
    ]  # fmt: skip
    content = recording.log.content
    between = content[content.index(marks[0]) : content.index(marks[1])]
    assert sum(entry for entry in between if isinstance(entry, int)) == first.stop - first.start
    assert recording.events.list_texts("checkpoint") == ["after segment a", "after segment b"]


def test_samples_before_the_recording_are_not_recorded(recording):
    columns = recording.recorder.add_samples(make_samples(900, 1_000))
    assert recording.log.content == [10]
    assert len(columns["displacement_command"]) == 100


def test_interrupted_segment_is_marked_but_is_not_a_checkpoint(recording):
    recording.recorder.add_samples(make_samples(1_000, 1_900))
    assert recording.recorder.segment == "a"
    recording.recorder.finish()
    assert recording.log.content[-1] == ("a", "end", 1_899 * MS)
    assert recording.events.list_texts("checkpoint") == []
    assert recording.recorder.segment == ""
