import numpy as np
import pytest

from sim_rig.errors import CommandsError, PlantError
from sim_rig.live.clock import RunningClock, SteppedClock
from sim_rig.live.rig import SAMPLE_PERIOD_NS, TRANSITION_NS, LiveRig
from sim_rig.live.sample_buffer import RingBuffer
from sim_rig.offline_run import CommandSeries, run_offline
from sim_rig.sensors.channels import CHANNELS

SERVO = {"start_ramp": 0.0}
CLOCKS = {"load_cell": {"drift": 3e-6}, "lvdt": {"drift": 3e-6}, "actuator": {}, "thermometer": {}}
ALL = 10**6
EVER = 10**18


@pytest.fixture(scope="module")
def scenario(varied):
    """The default rig without start ramp and mapping errors, which only an offline run has."""
    faults = [
        {"kind": "stuck", "channel": "force", "start": 1.0, "duration": 0.1},
        {"kind": "missing", "channel": "displacement", "start": 2.0, "duration": 0.05},
    ]
    return varied("default", actuator=SERVO, clocks=CLOCKS, faults=faults, seed=11)


def simulate_live(scenario, strokes, steps):
    """Return a live rig commanded sample by sample, which caught up after ``steps`` samples each."""
    clock = SteppedClock()
    rig = LiveRig(scenario, clock, strokes.displacement[0], strokes.drive[0])
    pauses = set(np.cumsum(steps).tolist())
    for index, (displacement, drive) in enumerate(zip(strokes.displacement, strokes.drive, strict=True)):
        rig.command("displacement", displacement)
        rig.command("drive", drive)
        if index in pauses:
            rig.catch_up()
        clock.advance(SAMPLE_PERIOD_NS)
    rig.catch_up()
    return rig


@pytest.fixture(scope="module")
def rig(scenario, strokes):
    return simulate_live(scenario, strokes, np.random.default_rng(2).integers(1, 40, 200))


@pytest.fixture(scope="module")
def offline(scenario, strokes):
    delay = TRANSITION_NS // SAMPLE_PERIOD_NS
    delayed = np.concatenate([np.full(delay, strokes.displacement[0]), strokes.displacement[:-delay]])
    return run_offline(scenario, CommandSeries(strokes.time, delayed, strokes.drive))


@pytest.mark.parametrize("channel", [name for name in CHANNELS if name != "temperature"])
def test_the_live_rig_has_the_readings_of_an_offline_run(rig, offline, channel):
    times, values = rig.read_latest(channel, ALL, EVER)
    assert len(values) >= 2995
    assert np.array_equal(times, np.arange(len(times)) * SAMPLE_PERIOD_NS)
    np.testing.assert_array_equal(values[:2995], offline.channels[channel][:2995])


def test_a_slow_channel_has_its_own_instants(rig, offline):
    times, values = rig.read_latest("temperature", ALL, EVER)
    assert np.array_equal(times, np.arange(30) * 100 * SAMPLE_PERIOD_NS)
    assert np.array_equal(values, offline.channels["temperature"][::100])


@pytest.mark.parametrize("field", ["position", "force", "output", "temperature"])
def test_the_live_rig_has_the_true_signals_of_an_offline_run(rig, offline, field):
    """The last sample is excluded, as an offline run holds its last command there."""
    record, known = rig.read_truth(), 2999 * len(getattr(offline.truth, field)) // 3000
    assert record.start_ns == 0
    assert np.array_equal(getattr(record.truth, field)[:known], getattr(offline.truth, field)[:known])


def test_the_size_of_the_batches_does_not_change_the_readings(scenario, strokes, rig):
    again = simulate_live(scenario, strokes, [1] * 3000)
    for channel in CHANNELS:
        np.testing.assert_array_equal(again.read_latest(channel, 2000, EVER), rig.read_latest(channel, 2000, EVER))


def test_samples_later_than_requested_are_left_out(rig):
    times, _ = rig.read_latest("force", 3, 1_000_500_000)
    assert times.tolist() == [998_000_000, 999_000_000, 1_000_000_000]
    assert len(rig.read_latest("force", 3, -1)[0]) == 0


def test_a_step_of_the_drive_takes_effect_at_the_next_update_of_the_amplifier(varied):
    clock = SteppedClock()
    rig = LiveRig(varied(), clock)
    clock.advance(10 * SAMPLE_PERIOD_NS + 1)
    rig.command("drive", 0.4)
    clock.advance(10 * SAMPLE_PERIOD_NS)
    rig.catch_up()
    times, values = rig.read_latest("coil_drive", ALL, EVER)
    assert times[values > 0.2][0] == 11 * SAMPLE_PERIOD_NS
    assert rig.read_latest("coil_current", 1, EVER)[1] == pytest.approx([0.4 / 5.0])


def test_an_invalid_command_is_refused(varied):
    rig = LiveRig(varied(), SteppedClock())
    with pytest.raises(CommandsError, match="takes displacement, drive, shunt"):
        rig.command("force", 1.0)
    with pytest.raises(CommandsError, match="commanded drive is nan; it must be finite"):
        rig.command("drive", float("nan"))


def test_old_samples_are_discarded(varied):
    clock = SteppedClock()
    rig = LiveRig(varied(), clock)
    clock.advance(30_000 * SAMPLE_PERIOD_NS)
    rig.catch_up()
    assert len(rig.read_latest("force", ALL, EVER)[0]) < 17_000
    assert 10_000 <= len(rig.read_truth().truth.output) < 10_500
    assert rig.read_latest("force", 4096, EVER)[0][0] > 25_800 * SAMPLE_PERIOD_NS


def test_the_thread_follows_a_clock_and_runs_periodic_tasks(varied):
    clock, calls = RunningClock(speed=20.0), []
    rig = LiveRig(varied(), clock, batch=40)
    rig.periodic_tasks = [lambda: calls.append(clock.now_ns())]
    with rig:
        # On a busy computer the thread may run late, but it still runs the tasks.
        while len(calls) <= 10 and rig.failure is None:
            clock.wait_until(clock.now_ns() + 500_000_000)
    assert rig.failure is None
    assert rig.read_latest("force", 1, EVER)[0][0] > 0
    assert calls == sorted(calls)


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


def test_a_full_buffer_keeps_the_newest_samples_in_order():
    buffer = RingBuffer(10)
    for start in range(0, 100, 7):
        buffer.add(np.arange(start, start + 7), np.arange(start, start + 7) * 1.0)
    times, values = buffer.read_latest(10, 1000)
    assert times.tolist() == list(range(95, 105))
    assert np.array_equal(times, values)


def test_the_shunt_adds_its_force_to_the_reading_only(varied):
    """It passes filter, gain and converter of the load cell, as in an offline run."""
    scenario = varied(
        "default", actuator=SERVO, clocks=CLOCKS, sensors={"force": {"noise": 1.0, "gain_error": 0.02}}
    )
    rest = CommandSeries(np.arange(600) * 1e-3, np.zeros(600), np.zeros(600), np.repeat([0.0, 1.0, 0.0], 200))
    clock = SteppedClock()
    rig = LiveRig(scenario, clock)
    for shunt in (0.0, scenario.sensors.force.shunt, 0.0):
        rig.command("shunt", shunt)
        clock.advance(200 * SAMPLE_PERIOD_NS)
        rig.catch_up()
    played = run_offline(scenario, rest)
    _, force = rig.read_latest("force", ALL, EVER)
    np.testing.assert_array_equal(force[:590], played.channels["force"][:590])
    without = run_offline(scenario, rest._replace(shunt=np.zeros(0)))
    difference = played.channels["force"] - without.channels["force"]
    assert np.max(np.abs(difference[250:390] - 1020.0)) < 1e-6
    assert np.max(np.abs(difference[:199])) == 0.0
    assert np.max(np.abs(difference[450:])) < 1e-6
    assert np.array_equal(played.truth.force, without.truth.force)
