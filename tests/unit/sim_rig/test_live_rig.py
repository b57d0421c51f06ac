import numpy as np
import pytest

from sim_rig.clock import RunningClock, SteppedClock
from sim_rig.errors import CommandsError, PlantError
from sim_rig.live_rig import STEP_NS, TAKE_UP_NS, LiveRig
from sim_rig.play import Commands, play
from sim_rig.recent import Recent
from sim_rig.sensors import CHANNELS

SERVO = {"start_ramp": 0.0}
CLOCKS = {"load_cell": {"wander": 3e-6}, "lvdt": {"wander": 3e-6}, "actuator": {}, "thermometer": {}}
ALL = 10**6
EVER = 10**18


@pytest.fixture(scope="module")
def scenario(varied):
    """The default rig, without what only a run on files has: a start ramp, and offsets that a mapping has left."""
    faults = [
        {"kind": "stuck", "channel": "force", "start": 1.0, "duration": 0.1},
        {"kind": "cut", "channel": "displacement", "start": 2.0, "duration": 0.05},
    ]
    return varied("default", actuator=SERVO, clocks=CLOCKS, faults=faults, seed=11)


def moved(scenario, strokes, steps):
    """A live rig that has been commanded sample by sample and has caught up after ``steps`` samples each."""
    clock = SteppedClock()
    rig = LiveRig(scenario, clock, strokes.displacement[0], strokes.drive[0])
    pauses = set(np.cumsum(steps).tolist())
    for place, (displacement, drive) in enumerate(zip(strokes.displacement, strokes.drive, strict=True)):
        rig.command("displacement", displacement)
        rig.command("drive", drive)
        if place in pauses:
            rig.catch_up()
        clock.advance(STEP_NS)
    rig.catch_up()
    return rig


@pytest.fixture(scope="module")
def rig(scenario, strokes):
    return moved(scenario, strokes, np.random.default_rng(2).integers(1, 40, 200))


@pytest.fixture(scope="module")
def played(scenario, strokes):
    late = TAKE_UP_NS // STEP_NS
    waiting = np.concatenate([np.full(late, strokes.displacement[0]), strokes.displacement[:-late]])
    return play(scenario, Commands(strokes.time, waiting, strokes.drive))


@pytest.mark.parametrize("channel", [name for name in CHANNELS if name != "temperature"])
def test_the_live_rig_reports_what_a_run_on_files_reports(rig, played, channel):
    times, values = rig.latest(channel, ALL, EVER)
    assert len(values) >= 2995
    assert np.array_equal(times, np.arange(len(times)) * STEP_NS)
    np.testing.assert_array_equal(values[:2995], played.channels[channel][:2995])


def test_a_slow_channel_has_its_own_instants(rig, played):
    times, values = rig.latest("temperature", ALL, EVER)
    assert np.array_equal(times, np.arange(30) * 100 * STEP_NS)
    assert np.array_equal(values, played.channels["temperature"][::100])


@pytest.mark.parametrize("field", ["position", "force", "output", "temperature"])
def test_the_truth_is_the_same_motion(rig, played, field):
    """But for the last sample, in which a run on files holds its last command."""
    stretch, known = rig.truth(), 2999 * len(getattr(played.truth, field)) // 3000
    assert stretch.start_ns == 0
    assert np.array_equal(getattr(stretch.truth, field)[:known], getattr(played.truth, field)[:known])


def test_how_often_it_catches_up_does_not_change_the_readings(scenario, strokes, rig):
    again = moved(scenario, strokes, [1] * 3000)
    for channel in CHANNELS:
        np.testing.assert_array_equal(again.latest(channel, 2000, EVER), rig.latest(channel, 2000, EVER))


def test_a_sample_that_lies_later_than_asked_for_is_left_out(rig):
    times, _ = rig.latest("force", 3, 1_000_500_000)
    assert times.tolist() == [998_000_000, 999_000_000, 1_000_000_000]
    assert len(rig.latest("force", 3, -1)[0]) == 0


def test_a_step_of_the_drive_is_taken_at_the_next_update_of_the_amplifier(varied):
    clock = SteppedClock()
    rig = LiveRig(varied(), clock)
    clock.advance(10 * STEP_NS + 1)
    rig.command("drive", 0.4)
    clock.advance(10 * STEP_NS)
    rig.catch_up()
    times, values = rig.latest("coil_drive", ALL, EVER)
    assert times[values > 0.2][0] == 11 * STEP_NS
    assert rig.latest("coil_current", 1, EVER)[1] == pytest.approx([0.4 / 5.0])


def test_a_command_that_is_none_is_refused(varied):
    rig = LiveRig(varied(), SteppedClock())
    with pytest.raises(CommandsError, match="takes displacement and drive"):
        rig.command("force", 1.0)
    with pytest.raises(CommandsError, match="commanded drive is nan; it has to be finite"):
        rig.command("drive", float("nan"))


def test_what_lies_far_back_is_forgotten(varied):
    clock = SteppedClock()
    rig = LiveRig(varied(), clock)
    clock.advance(30_000 * STEP_NS)
    rig.catch_up()
    assert len(rig.latest("force", ALL, EVER)[0]) < 17_000
    assert 10_000 <= len(rig.truth().truth.output) < 10_500
    assert rig.latest("force", 4096, EVER)[0][0] > 25_800 * STEP_NS


def test_the_thread_follows_a_clock_and_attends_to_what_acts_by_the_time(varied):
    clock, attended = RunningClock(speed=20.0), []
    rig = LiveRig(varied(), clock, block=40)
    rig.attend = [lambda: attended.append(clock.now_ns())]
    with rig:
        # On a busy machine the thread may sleep through much of that time; it attends all the same.
        while len(attended) <= 10 and rig.failure is None:
            clock.wait_until(clock.now_ns() + 500_000_000)
    assert rig.failure is None
    assert rig.latest("force", 1, EVER)[0][0] > 0
    assert attended == sorted(attended)


def test_a_specimen_that_runs_away_ends_the_thread_with_the_reason(varied):
    clock = SteppedClock()
    with LiveRig(varied(), clock) as rig:
        rig.command("displacement", -1e9)
        clock.advance(10**9)
        rig._thread.join(30.0)
    assert isinstance(rig.failure, PlantError)


def test_stopping_twice_or_before_the_start_is_harmless(varied):
    rig = LiveRig(varied(), SteppedClock())
    rig.stop()
    rig.stop()
    assert rig.failure is None


def test_recent_samples_stay_in_order_when_the_old_ones_make_room():
    recent = Recent(10)
    for start in range(0, 100, 7):
        recent.add(np.arange(start, start + 7), np.arange(start, start + 7) * 1.0)
    times, values = recent.latest(10, 1000)
    assert times.tolist() == list(range(95, 105))
    assert np.array_equal(times, values)
