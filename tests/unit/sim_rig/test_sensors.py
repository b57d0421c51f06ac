import numpy as np
import pytest
from scipy import signal

from sim_rig.channel import ChannelStream, FilterStream, View, at_instants, drawn_for
from sim_rig.play import info, play
from sim_rig.sensors import readings
from sim_rig.settings import Clock, Filter, Sensor

TIME = np.arange(20_000) * 1e-3
FINE = np.arange(160_000) / 8e3


def channel(sensor, seed=1, clock=None, **view):
    """A channel that looks at truth kept every eighth of a millisecond."""
    random = np.random.default_rng(seed)
    drawn = drawn_for(sensor, clock or Clock(), random)
    return ChannelStream(View(1 / 8e3, **view), sensor.rate or 1e3, sensor, drawn, random)


def report(sensor, values=None, **settings):
    """Readings of a channel that looks at ``values`` (nothing, if None)."""
    return readings(channel(sensor, **settings), np.zeros(len(FINE)) if values is None else values, TIME)


def lag_of(values, frequency):
    """Time [s] by which a sine of a frequency [Hz] comes late, from its phase after one second."""
    carrier = np.exp(-2j * np.pi * frequency * TIME[1000:])
    return -np.angle(np.sum(values[1000:] * carrier) * 1j) / (2 * np.pi * frequency)


@pytest.fixture(scope="module")
def sine():
    return np.sin(2 * np.pi * 5 * FINE)


def test_an_ideal_sensor_reports_the_truth(sine):
    assert np.allclose(report(Sensor(), sine), sine[::8], atol=1e-12)


def test_noise_has_the_stated_size_and_is_white():
    noise = report(Sensor(noise=2.5))
    assert np.std(noise) == pytest.approx(2.5, rel=0.03)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.03


def test_slow_noise_has_the_stated_size_and_correlation_time():
    noise = report(Sensor(slow_noise=1.0, slow_noise_time=0.02))
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    assert np.corrcoef(noise[20:], noise[:-20])[0, 1] == pytest.approx(np.exp(-1), abs=0.1)


def test_readings_stand_on_the_steps_of_the_converter_and_within_its_limit(sine):
    read = report(Sensor(resolution=0.05, limit=0.5), sine)
    assert np.allclose(read / 0.05, np.round(read / 0.05))
    assert read.max() == 0.5
    assert read.min() == -0.5
    assert np.abs(read - np.clip(sine[::8], -0.5, 0.5)).max() <= 0.025 + 1e-9


def test_gain_zero_and_drift_shift_the_reading(sine):
    read = report(Sensor(gain_error=0.02, zero=3.0, drift=0.1), sine)
    assert np.allclose(read, 1.02 * sine[::8] + 3.0 + 0.1 * TIME)


def test_zero_shift_and_clock_offset_are_drawn_with_the_stated_spread():
    random = np.random.default_rng(0)
    drawn = [drawn_for(Sensor(zero_spread=2.0), Clock(mapping_error=1e-5), random) for _ in range(2000)]
    assert np.std([d.zero for d in drawn]) == pytest.approx(2.0, rel=0.06)
    assert np.std([d.offset for d in drawn]) == pytest.approx(1e-5, rel=0.06)


@pytest.mark.parametrize(("order", "frequency"), [(2, 5.0), (2, 300.0), (4, 200.0)])
def test_the_filter_is_the_analogue_butterworth_that_it_claims_to_be(order, frequency):
    wave = np.sin(2 * np.pi * frequency * FINE)
    passed = FilterStream(Filter(order=order), 1 / 8e3).take(wave)[8000:]
    analogue = signal.butter(order, 2 * np.pi * 300, analog=True)
    response = signal.freqs(*analogue, worN=[2 * np.pi * frequency])[1][0]
    expected = np.imag(response * np.exp(2j * np.pi * frequency * FINE[8000:]))
    assert np.abs(passed - expected).max() < 2 * (2 * np.pi * frequency / 8e3) ** 2 / 12


def test_a_filter_is_settled_at_the_first_value():
    assert np.allclose(FilterStream(Filter(), 1 / 8e3).take(np.full(100, 16.0)), 16.0)


def test_filter_and_delay_add_up_to_the_lag_of_the_channel(sine):
    lag = lag_of(report(Sensor(filter=Filter(), delay=4e-4), sine), 5.0)
    assert lag == pytest.approx(4e-4 + np.sqrt(2) / (2 * np.pi * 300), abs=2e-7)


def test_the_clock_error_that_mapping_leaves_comes_on_top_of_the_claimed_delay(sine):
    clock = Clock(mapping_error=5e-5)
    offset = drawn_for(Sensor(), clock, np.random.default_rng(3)).offset
    assert lag_of(report(Sensor(), sine, seed=3, clock=clock), 5.0) == pytest.approx(-offset, abs=2e-7)


def test_jitter_moves_each_reading_by_its_stamp(sine):
    error = report(Sensor(jitter=1e-5), sine) - sine[::8]
    assert np.std(error) == pytest.approx(1e-5 * 2 * np.pi * 5 / np.sqrt(2), rel=0.05)


def test_wander_is_a_slow_drift_of_the_stated_size(sine):
    error = report(Sensor(), sine, clock=Clock(wander=1e-5)) - sine[::8]
    assert 0 < np.abs(error).max() < 1.01e-5 * np.sqrt(2) * 2 * np.pi * 5


def test_a_slow_device_holds_its_reading_between_two_of_them(sine):
    read = report(Sensor(rate=10.0), sine)
    assert np.array_equal(read, np.repeat(read[::100], 100))


def test_signals_are_read_between_samples_to_the_third_order(sine):
    instants = np.linspace(0.1, 19.0, 777)
    assert np.abs(at_instants(sine, 1 / 8e3, instants) - np.sin(2 * np.pi * 5 * instants)).max() < 1e-9


def test_what_the_devices_claim_is_what_the_scenario_applies(varied):
    claimed = info(varied("default"), 1000.0)["channels"]
    low_pass = {"kind": "butterworth", "order": 2, "cutoff_hz": 300.0}
    assert claimed["force"] == {"unit": "N", "rate_hz": 1000.0, "filter": low_pass, "delay_s": 2e-4}
    assert claimed["displacement"] == {"unit": "m", "rate_hz": 1000.0, "filter": low_pass, "delay_s": 2e-4}
    assert claimed["temperature"]["rate_hz"] == 10.0


def test_the_default_rig_has_noise_of_a_decent_laboratory(varied, strokes):
    played = play(varied("default"), strokes)
    sensors = varied("default").sensors
    fine = FilterStream(sensors.force.filter, 1 / 8e3).take(played.truth.force)
    error = played.channels["force"] - at_instants(fine, 1 / 8e3, played.time - 2e-4)
    assert np.std(error) == pytest.approx(2.5, rel=0.15)
    assert np.mean(error) == pytest.approx(played.drawn["force"].zero, abs=0.2)


def test_seeds_reproduce_and_differ(varied, strokes):
    one, same, other = (play(varied("default", seed=seed), strokes).channels for seed in (4, 4, 5))
    for name, values in one.items():
        assert np.array_equal(values, same[name])
        assert not np.array_equal(values, other[name])


def test_the_measured_drive_at_a_sample_is_the_one_held_until_the_next(varied, strokes):
    drive = play(varied(), strokes).channels["coil_drive"]
    assert np.abs(drive - strokes.drive).max() < 1e-6


def test_a_stuck_channel_repeats_itself_and_a_cut_one_has_no_values(varied, strokes):
    faults = [
        {"kind": "stuck", "channel": "force", "start": 1.0, "duration": 0.1},
        {"kind": "cut", "channel": "displacement", "start": 2.0, "duration": 0.05},
    ]
    channels = play(varied("default", faults=faults), strokes).channels
    assert np.all(channels["force"][1000:1100] == channels["force"][999])
    assert np.flatnonzero(np.isnan(channels["displacement"])).tolist() == list(range(2000, 2050))
    assert np.isfinite(channels["force"]).all()


BUSY = Sensor(noise=2.0, slow_noise=1.0, filter=Filter(), delay=2e-4, jitter=1e-6, resolution=0.01, drift=0.1)


@pytest.mark.parametrize("sensor", [BUSY, Sensor(), Sensor(rate=10.0, delay=0.1), Sensor(delay=1e-3, jitter=2e-5)])
@pytest.mark.parametrize("held", [False, True])
def test_readings_do_not_depend_on_how_the_truth_is_cut(sine, sensor, held):
    clock = Clock(mapping_error=1e-5, wander=3e-6)
    whole = channel(sensor, clock=clock, held=held)
    whole.take(sine)
    stamps, expected = whole.make(whole.ready())
    cut, parts = channel(sensor, clock=clock, held=held), []
    for piece in np.split(sine, np.sort(np.random.default_rng(5).integers(0, len(sine), 3000))):
        cut.take(piece)
        parts.append(cut.make(cut.ready()))
    assert np.array_equal(np.concatenate([part[0] for part in parts]), stamps)
    assert np.array_equal(np.concatenate([part[1] for part in parts]), expected)
    assert len(expected) > 19.9 * (sensor.rate or 1e3)


def test_a_channel_keeps_no_more_of_the_truth_than_it_needs(sine):
    busy = channel(BUSY)
    for piece in np.split(sine, 1000):
        busy.take(piece)
        busy.make(busy.ready())
    assert len(busy._truth) < 200
