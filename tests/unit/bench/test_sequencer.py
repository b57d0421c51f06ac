"""What is sent at each instant, on a clock that the test steps; no thread, no wire."""

import itertools
import math

import numpy as np
import pytest

from bench.errors import Interlocked, RunError
from bench.methods import Method, compile_method
from bench.methods.compile import BETWEEN
from bench.sequencer.lead import Lead
from bench.sequencer.passages import after_segment, passages
from bench.sequencer.plan import Entry, RunPlan
from bench.sequencer.track import FADES, Playing, approach, standing

CYCLE, STALE = 0.004, 0.05
CYCLE_NS = 4_000_000


def sine(name, amplitude, frequency, drive, **more):
    motion = {"kind": "sine", "amplitude_m": amplitude, "frequency_hz": frequency}
    return {"name": name, "motion": motion, "cycles": 3, "drive": drive, "checkpoint": True, **more}


def constant(value):
    return {"kind": "constant", "value": value}


def programme(*segments, **limits):
    usual = {"stroke_m": 0.02, "velocity_mps": 0.3, "acceleration_mps2": 8.0, "force_n": 900.0, "drive": 1.0}
    method = Method.model_validate(
        {
            "schema": "mrbench.method/1",
            "name": "made_up",
            "title": "t",
            "description": "d",
            "rate_hz": 1000.0,
            "drive_kind": "coil_v",
            "limits": {**usual, **limits},
            "segments": list(segments),
        }
    )
    return compile_method(method)


TWO = programme(sine("a", 0.01, 2.0, constant(0.2)), sine("b", 0.005, 4.0, constant(0.4)))


class Recorded:
    """An actuator that keeps what it was sent."""

    def __init__(self):
        self.now_ns = 0
        self.sent = []

    def command(self, position, place_ns):
        self.sent.append((self.now_ns, position))


@pytest.fixture
def actuator():
    return Recorded()


@pytest.fixture
def plan():
    return RunPlan()


@pytest.fixture
def lead(actuator, plan):
    return Lead(actuator, lambda position: None, plan, CYCLE, STALE)


def stepped(lead, actuator, start_ns, cycles, jitter=None):
    """Step through cycles; where the last one was."""
    random = np.random.default_rng(5)
    for cycle in range(cycles):
        late = int(random.integers(0, jitter)) if jitter else 0
        actuator.now_ns = start_ns + cycle * CYCLE_NS + late
        lead.step(actuator.now_ns)
    return start_ns + cycles * CYCLE_NS


def test_each_setpoint_is_where_the_rod_is_to_be_a_cycle_later(lead, actuator):
    (part,) = passages(TWO, 1024)
    assert lead.play(part.track, part)
    stepped(lead, actuator, 1_000_000_000, 1100)
    sent = np.array(actuator.sent)
    due = (sent[:, 0] - sent[0, 0]) * 1e-9 + CYCLE
    assert np.allclose(sent[:, 1], np.interp(due, TWO.time, TWO.displacement), rtol=0, atol=1e-12)


def test_setpoints_that_leave_late_stay_on_the_way_in_time(lead, actuator):
    (part,) = passages(TWO, 1024)
    lead.play(part.track, part)
    stepped(lead, actuator, 0, 1100, jitter=3_500_000)
    sent = np.array(actuator.sent)
    due = (sent[:, 0] - sent[0, 0]) * 1e-9 + CYCLE
    assert np.allclose(sent[:, 1], np.interp(due, TWO.time, TWO.displacement), rtol=0, atol=1e-9)


@pytest.mark.parametrize("at", [0.3, 0.7, 1.1, 1.6, 2.9])
def test_a_stop_at_any_moment_fades_out_along_the_way_within_the_limits(lead, actuator, at):
    (part,) = passages(TWO, 1024)
    lead.play(part.track, part)
    now = stepped(lead, actuator, 0, round(at / CYCLE))
    limits = TWO.method.limits
    lead.stop(now, limits.acceleration_mps2)
    before = len(actuator.sent)
    now = stepped(lead, actuator, now, round((FADES[-1] + 0.1) / CYCLE))
    positions = np.array([position for _, position in actuator.sent])
    velocity = np.diff(positions) / CYCLE
    assert lead.done(now)
    assert np.all(velocity[-20:] == 0)
    assert np.max(np.abs(np.diff(velocity) / CYCLE)) <= 1.01 * limits.acceleration_mps2
    assert np.max(np.abs(velocity)) <= np.max(np.abs(TWO.velocity)) * 1.001
    # Still on the path that was planned, and soon at rest.
    assert np.min(TWO.displacement) <= positions.min()
    assert positions.max() <= np.max(TWO.displacement)
    assert np.flatnonzero(velocity)[-1] - before < 1.5 / CYCLE


def test_nothing_is_begun_after_a_stop(lead, actuator):
    (part,) = passages(TWO, 1024)
    lead.stand(0.001)
    now = stepped(lead, actuator, 0, 3)
    lead.stop(now, 8.0)
    assert not lead.play(part.track, part)
    stepped(lead, actuator, now, 300)
    assert {position for _, position in actuator.sent} == {0.001}


def test_a_silence_holds_setpoints_back_until_the_next_track(lead, actuator):
    (part,) = passages(TWO, 1024)
    lead.stand(0.0)
    now = stepped(lead, actuator, 0, 3)
    lead.hush(now)
    now = stepped(lead, actuator, now, 5)
    assert len(actuator.sent) == 3
    assert lead.play(part.track, part)
    stepped(lead, actuator, now, 1)
    assert isinstance(lead.playing, Playing)
    assert lead.playing.begin_ns == now


def test_a_silence_that_would_let_the_drive_stop_is_broken_and_told(lead, actuator):
    (part,) = passages(TWO, 1024)
    lead.stand(0.0)
    now = stepped(lead, actuator, 0, 3)
    lead.hush(now)
    stepped(lead, actuator, now, round(STALE / CYCLE))
    assert len(actuator.sent) > 3
    assert not lead.play(part.track, part)
    gaps = np.diff([instant for instant, _ in actuator.sent])
    assert gaps.max() * 1e-9 < 0.8 * STALE


def test_what_is_forbidden_is_not_sent(actuator, plan):
    def forbid(position):
        if abs(position) > 0.005:
            raise Interlocked("too far")

    lead = Lead(actuator, forbid, plan, CYCLE, STALE)
    (part,) = passages(TWO, 1024)
    lead.play(part.track, part)
    with pytest.raises(Interlocked):
        stepped(lead, actuator, 0, 1100)
    assert max(abs(position) for _, position in actuator.sent) <= 0.005


def test_the_way_to_the_first_position_is_soft():
    way = approach(-0.03, 0.01)
    assert way.displacement[[0, -1]] == pytest.approx([-0.03, 0.01], abs=1e-12)
    velocity = np.diff(way.displacement) * way.rate
    assert np.max(np.abs(velocity)) <= 0.031
    assert np.max(np.abs(np.diff(velocity))) * way.rate <= 0.31


def test_the_plan_says_what_was_commanded_when(lead, actuator, plan):
    (part,) = passages(TWO, 1024)
    lead.play(part.track, part)
    stepped(lead, actuator, 500, 1100)
    found = plan.at(500 + np.round(TWO.time * 1e9).astype(np.int64))
    assert np.allclose(found.displacement, TWO.displacement, rtol=0, atol=1e-12)
    assert np.array_equal(found.drive, TWO.drive)
    assert np.array_equal(found.segment[:-1], TWO.segment[:-1])
    assert np.isnan(plan.at(np.array([499])).displacement).all()


def test_after_a_stop_the_plan_says_coil_off_and_no_segment(lead, actuator, plan):
    (part,) = passages(TWO, 1024)
    lead.play(part.track, part)
    now = stepped(lead, actuator, 0, 200)
    plan.switch_off(now)
    lead.stop(now, 8.0)
    found = plan.at(np.array([now - 1, now, now + 10_000_000_000]))
    assert found.drive.tolist() == [0.2, 0.0, 0.0]
    assert found.segment.tolist() == [0, BETWEEN, BETWEEN]
    assert found.displacement[2] == pytest.approx(lead.playing.position(now + 20_000_000_000))
    assert not plan.reached(TWO.segments[0].stop, now)
    assert plan.reached(TWO.segments[0].start, now)


def stepped_drive(count):
    times = [0.02 * index for index in range(count)]
    return {"kind": "steps", "time_s": times, "values": [0.1 * (index % 3) for index in range(count)]}


def test_a_programme_with_more_steps_than_the_table_is_cut_where_it_rests():
    many = programme(*(sine(f"s{index}", 0.005, 1.0, stepped_drive(40)) for index in range(4)))
    parts = passages(many, 100)
    assert len(parts) > 1
    assert (parts[0].start, parts[-1].stop) == (0, len(many.time) - 1)
    assert all(first.stop == second.start for first, second in itertools.pairwise(parts))
    for part in parts:
        times, levels = part.steps()
        assert len(times) <= 100
        assert abs(many.velocity[part.start]) < 1e-6
        at = np.searchsorted(times, np.arange(part.stop - part.start) / many.rate + 1e-9, side="right") - 1
        assert np.array_equal(levels[at], many.drive[part.start : part.stop])


def test_a_long_programme_sets_out_again_with_the_amplifiers_clock():
    long = programme(*(sine(f"s{index}", 0.005, 0.1, constant(0.1)) for index in range(4)))
    parts = passages(long, 1024)
    assert len(parts) > 1
    assert all((part.stop - part.start) / long.rate <= 60.0 for part in parts)


def test_a_drive_that_the_table_cannot_hold_is_refused():
    ramp = programme(sine("swept", 0.005, 1.0, {"kind": "ramp", "start": 0.0, "end": 0.5}))
    with pytest.raises(RunError, match=r"segment swept: the drive takes \d{4} values .* holds 1024; shorten"):
        passages(ramp, 1024)


def test_an_interrupted_run_goes_on_at_rest_after_a_checkpoint():
    first = after_segment(TWO, "a")
    assert TWO.segments[0].stop <= first <= TWO.segments[1].start
    assert abs(TWO.velocity[first]) < 1e-6
    assert passages(TWO, 1024, first)[0].start == first
    with pytest.raises(RunError, match="its checkpoints: a, b"):
        after_segment(TWO, "c")
    with pytest.raises(RunError, match="nothing comes after"):
        after_segment(TWO, "b")


def test_the_plan_knows_how_far_it_should_be_at_an_instant(plan):
    (part,) = passages(TWO, 500)
    begin = 7_000_000_000
    assert not plan.reached(0, begin)
    assert plan.progress(begin) == (0.0, BETWEEN)
    plan.enter(Entry(Playing(approach(0.0, 0.001), begin - 1_000_000_000)))
    plan.enter(Entry(Playing(part.track, begin), part))
    sample = TWO.segments[1].start
    due = begin + round(TWO.time[sample] * 1e9)
    assert not plan.reached(sample, due - 2_000_000)
    assert plan.reached(sample, due)
    assert not plan.reached(0, begin - 1)
    assert plan.progress(due) == (pytest.approx(TWO.time[sample]), 1)
    plan.switch_off(due)
    assert plan.progress(due) == (pytest.approx(TWO.time[sample]), BETWEEN)


def test_the_same_passage_stopped_takes_the_place_of_itself(plan):
    (part,) = passages(TWO, 500)
    playing = Playing(part.track, 1000)
    plan.enter(Entry(playing, part))
    plan.enter(Entry(playing.stopped(500_000_000, 8.0), part))
    assert [entry.playing.fade is not None for entry in plan.entries] == [True]


def test_where_the_rod_was_sent_is_unknown_before_the_first_setpoint(plan):
    assert math.isnan(plan.position(0))
    plan.enter(Entry(Playing(standing(0.003), 10)))
    assert math.isnan(plan.position(9))
    assert plan.position(10) == 0.003
