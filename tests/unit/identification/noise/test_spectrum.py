"""Noise behind what the fits of windows leave."""

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.noise.repeated_windows import RepeatedWindow
from identification.noise.smooth_spectrum import fit_smooth_spectrum
from identification.noise.spectrum import (
    WindowSpectrum,
    collect_known_bins,
    estimate_window_noise,
    fit_low_frequency_spectrum,
    make_spectrum,
)
from identification.noise.window_fit import CycleFit, WindowFit
from tests.support.noise import make_pink_noise

RATE = 500.0


def make_noisy_spectra(noise, windows=6, cycles=6, period=250.0):
    count = int(cycles * period)
    angle = 2.0 * np.pi * np.arange(count) / period
    motion = np.stack([np.sin(angle), np.cos(angle), -np.sin(angle)])
    spectra = []
    for k in range(windows):
        force = 40.0 * np.tanh(5.0 * np.cos(angle)) + noise[k * count : (k + 1) * count]
        fit = WindowFit(CycleFit(RepeatedWindow(0, period, cycles, force, motion, np.ones(count, bool))))
        spectra.append(make_spectrum(fit, fit.remove(force[:, None])[:, 0], RATE))
    return spectra


def estimate(noise, **more):
    spectra = make_noisy_spectra(noise, **more)
    smooth = fit_smooth_spectrum(*collect_known_bins(spectra))
    return [estimate_window_noise(s, smooth, len(noise) / RATE) for s in spectra], smooth


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_the_variance_of_noise_of_any_spectrum_is_found(correlation):
    white = np.random.default_rng(8).standard_normal(9000)
    noise = lfilter([1.0], [1.0, -correlation], white)
    found, _ = estimate(noise)
    mean = np.mean([n.variance for n in found])
    assert mean == pytest.approx(np.var(noise), rel=0.12)
    assert {n.samples for n in found} == {1500}
    assert {n.cycles for n in found} == {6}
    # The stated deviation is that of the scatter between windows.
    scatter = np.std([n.variance for n in found])
    assert 0.3 * scatter < np.mean([n.deviation for n in found]) < 3.0 * scatter


def test_two_cycles_show_slow_noise_within_a_large_uncertainty():
    noise = lfilter([1.0], [1.0, -0.9], np.random.default_rng(5).standard_normal(8000))
    found, _ = estimate(noise, windows=16, cycles=2)
    error = np.mean([n.variance for n in found]) - np.var(noise)
    uncertainty = np.mean([n.extrapolated for n in found])
    assert abs(error) < 2.0 * uncertainty
    (many,), _ = estimate(noise, windows=1, cycles=32)
    assert many.extrapolated < 0.1 * uncertainty


def draw_spectra(make, count=400):
    frequency = np.arange(1001) * 0.2
    window = make_noisy_spectra(np.zeros(1500), windows=1)[0].window
    mean = make(np.maximum(frequency, 0.1))
    draws = np.random.default_rng(7).exponential(size=(count, 1001)) * mean
    return [WindowSpectrum(frequency, power, np.ones(1001), window) for power in draws]


@pytest.mark.parametrize(("white", "pink"), [(3.0, 0.0), (0.0, 3.0), (2.0, 3.0)])
def test_the_low_spectrum_is_white_and_pink_noise_in_the_lowest_decade(white, pink):
    found = fit_low_frequency_spectrum(draw_spectra(lambda f: np.where(f < 2.1, white + pink / f, 1e3)))
    assert found[:2] == pytest.approx((white, pink), rel=0.15, abs=0.15)


def test_the_pink_part_of_few_bins_has_their_uncertainty():
    """Each of 200 fits has few bins and its own standard deviation."""
    spectra = draw_spectra(lambda f: 2.0 + 3.0 / np.maximum(f, 0.1), 200)
    found = [fit_low_frequency_spectrum([s]) for s in spectra]
    spread = np.std([f.pink for f in found])
    assert np.median([f.pink_deviation for f in found]) == pytest.approx(spread, rel=0.3)


def test_the_low_spectrum_never_rises_with_the_frequency():
    found = fit_low_frequency_spectrum(draw_spectra(lambda f: f**2))
    assert found.pink == 0.0
    assert found.white > 0.0


def test_only_bins_with_a_sufficient_gain_show_the_noise():
    window = make_noisy_spectra(np.zeros(1500), windows=1)[0].window
    gain = np.where(np.arange(100) < 7, 0.1, 0.4)
    spectrum = WindowSpectrum(np.arange(100.0), np.full(100, 2.0), gain, window)
    assert spectrum.lowest_known == 7
    frequency, power, gains = collect_known_bins([spectrum, spectrum._replace(gain=np.full(100, 0.1))])
    assert frequency == pytest.approx(np.arange(7.0, 100.0))
    assert set(power) == {2.0}
    assert set(gains) == {0.4}


def test_the_part_below_the_windows_is_uncertain_in_slow_noise():
    white, _ = estimate(np.random.default_rng(8).standard_normal(9000))
    assert white[0].extrapolated < 2e-3
    pink = make_pink_noise(9000, np.random.default_rng(9))
    found, _ = estimate(pink)
    assert 0.02 < np.mean([n.extrapolated for n in found]) / np.var(pink) < 0.5


def test_two_cycles_show_fast_scales_and_extrapolate_slow_ones():
    noise = lfilter([1.0], [1.0, -0.97], np.random.default_rng(5).standard_normal(8000))
    two, _ = estimate(noise, windows=16, cycles=2)
    many, _ = estimate(noise, windows=1, cycles=32)
    shares = np.mean([[s.extrapolated / s.variance for s in n.scales] for n in two], axis=0)
    assert shares[0] < 0.05
    assert shares[-1] > 2.0 * shares[0]
    assert shares[-1] > 0.1
    last = two[0].scales[-1]
    assert last.uncertainty == pytest.approx(np.hypot(last.deviation, last.extrapolated))
    seen = many[0].scales[len(two[0].scales) - 1]
    assert seen.extrapolated < 0.05 * seen.variance
