import numpy as np
import pytest
from scipy import signal

from sim_rig.offline_run import make_device_info, run_offline
from sim_rig.scenario.sections import ClockDeviation, Filter, Sensor
from sim_rig.sensors.channels import read_channel
from sim_rig.sensors.sampling import FilterStream, interpolate_cubic
from sim_rig.sensors.sensor import ChannelStream, SamplingModel, sample_channel_errors

TIME = np.arange(20_000) * 1e-3
FINE = np.arange(160_000) / 8e3


def channel(sensor, seed=1, clock=None, **model):
    """Return a channel with true values every eighth of a millisecond."""
    random = np.random.default_rng(seed)
    errors = sample_channel_errors(sensor, clock or ClockDeviation(), random)
    return ChannelStream(SamplingModel(1 / 8e3, **model), sensor.rate or 1e3, sensor, errors, random)


def report(sensor, values=None, **settings):
    """Return the readings of a channel with the true ``values``, or zeros."""
    return read_channel(channel(sensor, **settings), np.zeros(len(FINE)) if values is None else values, TIME)


def measure_lag(values, frequency):
    """Return the lag [s] of a sine of a frequency [Hz], from its phase after one second."""
    carrier = np.exp(-2j * np.pi * frequency * TIME[1000:])
    return -np.angle(np.sum(values[1000:] * carrier) * 1j) / (2 * np.pi * frequency)


@pytest.fixture(scope="module")
def sine():
    return np.sin(2 * np.pi * 5 * FINE)


def test_an_ideal_sensor_reports_the_true_values(sine):
    assert np.allclose(report(Sensor(), sine), sine[::8], atol=1e-12)


def test_noise_has_the_stated_size_and_is_white():
    noise = report(Sensor(noise=2.5))
    assert np.std(noise) == pytest.approx(2.5, rel=0.03)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.03


def test_slow_noise_has_the_stated_size_and_correlation_time():
    noise = report(Sensor(slow_noise=1.0, slow_noise_time=0.02))
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    assert np.corrcoef(noise[20:], noise[:-20])[0, 1] == pytest.approx(np.exp(-1), abs=0.1)


def test_readings_are_quantised_and_limited(sine):
    readings = report(Sensor(resolution=0.05, limit=0.5), sine)
    assert np.allclose(readings / 0.05, np.round(readings / 0.05))
    assert readings.max() == 0.5
    assert readings.min() == -0.5
    assert np.abs(readings - np.clip(sine[::8], -0.5, 0.5)).max() <= 0.025 + 1e-9


def test_gain_zero_and_drift_shift_the_reading(sine):
    readings = report(Sensor(gain_error=0.02, zero=3.0, drift=0.1), sine)
    assert np.allclose(readings, 1.02 * sine[::8] + 3.0 + 0.1 * TIME)


def test_zero_shift_and_clock_offset_have_the_stated_spread():
    random = np.random.default_rng(0)
    samples = [
        sample_channel_errors(Sensor(zero_spread=2.0), ClockDeviation(mapping_error=1e-5), random)
        for _ in range(2000)
    ]
    assert np.std([d.zero for d in samples]) == pytest.approx(2.0, rel=0.06)
    assert np.std([d.offset for d in samples]) == pytest.approx(1e-5, rel=0.06)


@pytest.mark.parametrize(("order", "frequency"), [(2, 5.0), (2, 300.0), (4, 200.0)])
def test_the_filter_has_the_response_of_its_analogue_butterworth(order, frequency):
    wave = np.sin(2 * np.pi * frequency * FINE)
    filtered = FilterStream(Filter(order=order), 1 / 8e3).feed(wave)[8000:]
    analogue = signal.butter(order, 2 * np.pi * 300, analog=True)
    response = signal.freqs(*analogue, worN=[2 * np.pi * frequency])[1][0]
    expected = np.imag(response * np.exp(2j * np.pi * frequency * FINE[8000:]))
    assert np.abs(filtered - expected).max() < 2 * (2 * np.pi * frequency / 8e3) ** 2 / 12


def test_a_filter_is_settled_at_the_first_value():
    assert np.allclose(FilterStream(Filter(), 1 / 8e3).feed(np.full(100, 16.0)), 16.0)


def test_filter_and_delay_add_up_to_the_lag_of_the_channel(sine):
    lag = measure_lag(report(Sensor(filter=Filter(), delay=4e-4), sine), 5.0)
    assert lag == pytest.approx(4e-4 + np.sqrt(2) / (2 * np.pi * 300), abs=2e-7)


def test_the_mapping_error_of_the_clock_adds_to_the_reported_delay(sine):
    clock = ClockDeviation(mapping_error=5e-5)
    offset = sample_channel_errors(Sensor(), clock, np.random.default_rng(3)).offset
    assert measure_lag(report(Sensor(), sine, seed=3, clock=clock), 5.0) == pytest.approx(-offset, abs=2e-7)


def test_jitter_shifts_each_reading(sine):
    error = report(Sensor(jitter=1e-5), sine) - sine[::8]
    assert np.std(error) == pytest.approx(1e-5 * 2 * np.pi * 5 / np.sqrt(2), rel=0.05)


def test_the_clock_drift_has_the_stated_size(sine):
    error = report(Sensor(), sine, clock=ClockDeviation(drift=1e-5)) - sine[::8]
    assert 0 < np.abs(error).max() < 1.01e-5 * np.sqrt(2) * 2 * np.pi * 5


def test_a_slow_device_holds_its_readings(sine):
    readings = report(Sensor(rate=10.0), sine)
    assert np.array_equal(readings, np.repeat(readings[::100], 100))


def test_signals_are_interpolated_to_the_third_order(sine):
    instants = np.linspace(0.1, 19.0, 777)
    assert np.abs(interpolate_cubic(sine, 1 / 8e3, instants) - np.sin(2 * np.pi * 5 * instants)).max() < 1e-9


def test_the_reported_filters_and_delays_are_those_of_the_scenario(varied):
    reported = make_device_info(varied("default"), 1000.0)["channels"]
    low_pass = {"kind": "butterworth", "order": 2, "cutoff_hz": 300.0}
    assert reported["force"] == {"unit": "N", "rate_hz": 1000.0, "filter": low_pass, "delay_s": 2e-4}
    assert reported["displacement"] == {"unit": "m", "rate_hz": 1000.0, "filter": low_pass, "delay_s": 2e-4}
    assert reported["temperature"]["rate_hz"] == 10.0


def test_the_default_rig_has_the_noise_of_its_scenario(varied, strokes):
    result = run_offline(varied("default"), strokes)
    sensors = varied("default").sensors
    fine = FilterStream(sensors.force.filter, 1 / 8e3).feed(result.truth.force)
    error = result.channels["force"] - interpolate_cubic(fine, 1 / 8e3, result.time - 2e-4)
    assert np.std(error) == pytest.approx(2.5, rel=0.15)
    assert np.mean(error) == pytest.approx(result.channel_errors["force"].zero, abs=0.2)


def test_seeds_reproduce_and_differ(varied, strokes):
    first, same, other = (run_offline(varied("default", seed=seed), strokes).channels for seed in (4, 4, 5))
    for name, values in first.items():
        assert np.array_equal(values, same[name])
        assert not np.array_equal(values, other[name])


def test_the_measured_drive_at_a_sample_is_the_one_held_until_the_next(varied, strokes):
    drive = run_offline(varied(), strokes).channels["coil_drive"]
    assert np.abs(drive - strokes.drive).max() < 1e-6


def test_a_stuck_channel_repeats_its_reading_and_a_missing_one_has_no_values(varied, strokes):
    faults = [
        {"kind": "stuck", "channel": "force", "start": 1.0, "duration": 0.1},
        {"kind": "missing", "channel": "displacement", "start": 2.0, "duration": 0.05},
    ]
    channels = run_offline(varied("default", faults=faults), strokes).channels
    assert np.all(channels["force"][1000:1100] == channels["force"][999])
    assert np.flatnonzero(np.isnan(channels["displacement"])).tolist() == list(range(2000, 2050))
    assert np.isfinite(channels["force"]).all()


BUSY = Sensor(noise=2.0, slow_noise=1.0, filter=Filter(), delay=2e-4, jitter=1e-6, resolution=0.01, drift=0.1)


@pytest.mark.parametrize("sensor", [BUSY, Sensor(), Sensor(rate=10.0, delay=0.1), Sensor(delay=1e-3, jitter=2e-5)])
@pytest.mark.parametrize("held", [False, True])
def test_readings_do_not_depend_on_the_chunks_of_true_values(sine, sensor, held):
    clock = ClockDeviation(mapping_error=1e-5, drift=3e-6)
    whole = channel(sensor, clock=clock, held=held)
    whole.feed(sine)
    stamps, expected = whole.make_readings(whole.count_ready())
    chunked, parts = channel(sensor, clock=clock, held=held), []
    for chunk in np.split(sine, np.sort(np.random.default_rng(5).integers(0, len(sine), 3000))):
        chunked.feed(chunk)
        parts.append(chunked.make_readings(chunked.count_ready()))
    assert np.array_equal(np.concatenate([part[0] for part in parts]), stamps)
    assert np.array_equal(np.concatenate([part[1] for part in parts]), expected)
    assert len(expected) > 19.9 * (sensor.rate or 1e3)


def test_a_channel_discards_true_values_that_it_no_longer_needs(sine):
    busy = channel(BUSY)
    for chunk in np.split(sine, 1000):
        busy.feed(chunk)
        busy.make_readings(busy.count_ready())
    assert len(busy._true_values) < 200
