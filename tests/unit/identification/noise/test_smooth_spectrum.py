"""Smooth spectrum of noise, and what it tells about frequencies that no window shows."""

import numpy as np
import pytest

from identification.noise.smooth_spectrum import MissingPart, fit_smooth_spectrum

STEP = 0.2
FREQUENCY = np.arange(2.0, 200.0, STEP)
SPECTRA = {
    "white": lambda f: np.full(len(f), 3.0),
    "1/f": lambda f: 3.0 / f,
    "relaxation": lambda f: 3.0 / (1.0 + (f / 4.0) ** 2),
    "white and 1/f": lambda f: 0.5 + 3.0 / f,
}


def draw(spectrum, seed=3, gain=1.0, windows=8):
    """Fit exponentially distributed powers with a mean spectrum, of which a part was seen."""
    frequency = np.tile(FREQUENCY, windows)
    powers = spectrum(frequency) * np.random.default_rng(seed).exponential(size=len(frequency))
    return fit_smooth_spectrum(frequency, gain * powers, np.full(len(frequency), gain))


def complete(smooth, stop=2.0, samples=1000, duration=5.0):
    """The missing part of a window below a frequency [Hz]."""
    frequency = np.arange(0.0, stop + 0.5 * STEP, STEP)
    return MissingPart(smooth, frequency, samples, duration)


@pytest.mark.parametrize("gain", [1.0, 0.3])
@pytest.mark.parametrize("name", SPECTRA)
def test_observed_frequencies_have_their_mean_power(name, gain):
    part = complete(draw(SPECTRA[name], gain=gain), 100.0)
    bins = np.arange(0.0, 100.0, STEP)[20:]
    assert np.mean(part.power[20:500] / SPECTRA[name](bins[:480])) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("name", SPECTRA)
def test_the_part_below_has_the_stated_uncertainty(name):
    """Most errors of the variance below the observed frequencies are within one standard deviation."""
    frequency = np.linspace(0.1, 1.9, 20_001)
    truth = 2.0 * np.trapezoid(SPECTRA[name](frequency), frequency) / STEP / 1000
    errors = []
    for seed in range(30):
        part = complete(draw(SPECTRA[name], seed))
        found = 2.0 * part.power[1:].sum() / 1000
        errors.append((found - truth) / part.compute_deviation(np.append(0.0, np.ones(9))))
    assert np.mean(np.abs(errors) < 1.0) > 0.6
    assert np.mean(np.abs(errors) < 2.0) > 0.9


def test_a_relaxation_ends_and_1_f_noise_does_not():
    relaxation, pink = (complete(draw(SPECTRA[name], windows=60)).power for name in ("relaxation", "1/f"))
    assert relaxation[1] < 1.3 * relaxation[9]
    assert pink[1] > 5.0 * pink[9]


def test_the_first_bin_reaches_down_to_one_cycle_of_the_recording():
    smooth = draw(SPECTRA["1/f"], windows=60)
    short, long = (complete(smooth, duration=d).power[0] for d in (20.0, 2000.0))
    assert long / short == pytest.approx(np.log(2000.0 * 0.1) / np.log(20.0 * 0.1), rel=0.15)


def test_few_bins_leave_the_part_below_uncertain():
    ones = np.ones(10)
    few, many = (complete(draw(SPECTRA["white"], windows=w)) for w in (1, 60))
    relative = [part.compute_deviation(ones) / (2.0 * part.power.sum() / 1000) for part in (few, many)]
    assert relative[0] > 2.0 * relative[1]


def test_a_force_without_noise_has_none():
    part = complete(draw(lambda f: np.zeros(len(f))))
    assert not part.power.any()
    assert part.compute_deviation(np.ones(10)) == 0.0


def test_one_bin_tells_little():
    smooth = fit_smooth_spectrum(np.array([2.0]), np.array([2.0]), np.array([0.5]))
    part = complete(smooth)
    assert part.compute_deviation(np.ones(10)) > 0.5 * (2.0 * part.power.sum() / 1000)
