"""Spectrum of the noise in repeated windows, completed where the windows' fits remove it.

A fit removes the noise at the harmonics of the stroke and at the lowest frequencies. At the harmonics, the missing
part is taken from the frequencies around them. Below the lowest bins, the spectrum is the sum of white and of 1/f
noise, down to one cycle in the whole recording. No form of the spectrum is assumed elsewhere.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import nnls

from identification.arrays import Array, BoolArray
from identification.noise.repeated_windows import RepeatedWindow
from identification.noise.time_scales import ScaleVariance, compute_deviations, compute_gain, list_scales
from identification.noise.window_fit import WindowFit

_KNOWN_GAIN = 0.5
"""Gain from which a bin shows the noise itself [1]."""
_LOW_DECADE = 10.0
"""Ratio of the highest to the lowest frequency that determine the spectrum at low frequencies [1]."""
_ITERATIONS = 30
"""Steps of its maximum-likelihood fit; the weights then change by less than a millionth."""
_SMOOTHED_BINS = 9
"""Frequency bins over which the spectrum is averaged for the variance of its sum."""


class WindowSpectrum(NamedTuple):
    """Power of the noise in one window of N samples, (N // 2 + 1,) each."""

    frequency: Array
    """Frequencies of the bins [Hz]."""
    power: Array
    """Power of the remainder of the fit, |rfft|² / N [N²]."""
    gain: Array
    """Part of the power of white noise that the fit leaves [1]."""
    window: RepeatedWindow

    @property
    def is_known(self) -> BoolArray:
        """True in bins that show the noise itself."""
        return np.asarray((self.gain > _KNOWN_GAIN) & (self.frequency > 0.0))

    @property
    def lowest_known(self) -> int:
        """Index of the first bin that shows the noise itself; 0 without any."""
        return int(np.argmax(self.is_known))


class LowFrequencySpectrum(NamedTuple):
    """Power of the noise at low frequencies: a white part and a part that falls with the frequency."""

    white: float
    """Power of the white part [N²]."""
    pink: float
    """Power of the other part at 1 Hz [N²]."""
    pink_deviation: float = 0.0
    """Standard deviation of ``pink`` [N²]."""

    def evaluate(self, frequency: Array) -> Array:
        """Return the power (B,) [N²] at frequencies (B,) [Hz]."""
        return np.asarray(self.white + self.pink / frequency)

    def integrate(self, start: float, stop: float) -> float:
        """Return the integral of the power [N² Hz] from one frequency to another [Hz]."""
        return self.white * (stop - start) + self.pink * float(np.log(stop / start))


class WindowNoise(NamedTuple):
    """Noise of one window."""

    variance: float
    """Variance of the noise [N²]."""
    deviation: float
    """Standard deviation of that variance where the spectrum was observed [N²]."""
    extrapolated: float
    """Part of the variance below the observed frequencies [N²]."""
    samples: int
    """Number of valid samples."""
    cycles: int
    scales: tuple[ScaleVariance, ...] = ()
    """Variance of the noise by time scale."""


def make_spectrum(fit: WindowFit, remainder: Array, rate: float) -> WindowSpectrum:
    """Return the spectrum of the remainder of a window's fit of the force (N,) [N] at a rate [Hz]."""
    count = len(remainder)
    power = np.asarray(np.abs(np.fft.rfft(remainder)) ** 2 / count, float)
    frequency = np.asarray(np.arange(len(power)) * (rate / count), float)
    return WindowSpectrum(frequency, power, fit.gain, fit.window)


def fit_low_frequency_spectrum(spectra: Sequence[WindowSpectrum]) -> LowFrequencySpectrum:
    """Fit the spectrum to the lowest decade that the spectra of one stretch show, by maximum likelihood."""
    frequency = np.concatenate([s.frequency[s.is_known] for s in spectra])
    power = np.concatenate([(s.power / s.gain)[s.is_known] for s in spectra])
    if not len(frequency):
        return LowFrequencySpectrum(
            sum(float(s.power.sum()) for s in spectra) / sum(float(s.gain.sum()) for s in spectra), 0.0
        )
    low = frequency <= _LOW_DECADE * frequency.min()
    frequency, scale = frequency[low], float(power[low].mean())
    if scale < 1e-300:
        return LowFrequencySpectrum(0.0, 0.0)
    power = power[low] / scale
    columns = np.column_stack([np.ones(len(frequency)), frequency.min() / frequency])
    level = np.ones(len(frequency))
    for _ in range(_ITERATIONS):
        # A power is exponentially distributed: its standard deviation is its mean (Whittle 1953).
        white, pink = nnls(columns / level[:, None], power / level)[0]
        level = np.maximum(columns @ [white, pink], 1e-6)
    deviation = float(compute_deviations(columns / level[:, None])[1])
    lowest = float(frequency.min())
    return LowFrequencySpectrum(scale * float(white), scale * float(pink) * lowest, scale * deviation * lowest)


def estimate_window_noise(spectrum: WindowSpectrum, low: LowFrequencySpectrum, duration: float) -> WindowNoise:
    """Return the noise of a window.

    Args:
        spectrum: its spectrum.
        low: spectrum at the lowest frequencies.
        duration: duration of the whole recording [s], whose mean is not noise.
    """
    values = _fill_harmonics(spectrum)
    step = float(spectrum.frequency[1])
    lowest = spectrum.lowest_known
    values[1:lowest] = low.evaluate(spectrum.frequency[1:lowest])
    # A bin stands for half a step on both sides; the first one begins at one cycle a recording.
    values[0] = low.integrate(min(1.0 / duration, 0.25 * step), 0.5 * step) / step
    count = len(spectrum.window.force)
    last = values[-1] if count % 2 == 0 else 0.0
    variance = float(2.0 * values.sum() - last) / count
    deviation = _compute_deviation(values, spectrum)
    samples = int(np.count_nonzero(spectrum.window.valid))
    scales = tuple(_compute_scale_variance(values, spectrum, m) for m in list_scales(samples))
    return WindowNoise(
        variance, deviation, 2.0 * float(values[0]) / count, samples, spectrum.window.cycles, scales
    )


def _compute_scale_variance(values: Array, spectrum: WindowSpectrum, samples: int) -> ScaleVariance:
    """Return the variance at a scale of noise with the power ``values`` (N // 2 + 1,) [N²]."""
    count = len(spectrum.window.force)
    seen = values * compute_gain(np.arange(len(values)) / count, samples)
    variance, extrapolated = (
        2.0 * float(seen[1:stop].sum()) / count for stop in (len(seen), spectrum.lowest_known)
    )
    return ScaleVariance(samples, variance, _compute_deviation(seen, spectrum), extrapolated)


def _compute_deviation(values: Array, spectrum: WindowSpectrum) -> float:
    """Return the standard deviation [N²] of the variance of noise with the power ``values`` (N // 2 + 1,) [N²]."""
    smooth = uniform_filter1d(values, min(_SMOOTHED_BINS, len(values)), mode="nearest")[1:]
    return 2.0 * float(np.sqrt((smooth**2).sum() / spectrum.gain[1:].mean())) / len(spectrum.window.force)


def _fill_harmonics(spectrum: WindowSpectrum) -> Array:
    """Return the power (N // 2 + 1,) [N²] with the removed part from the frequencies around."""
    width, gain = 2 * spectrum.window.cycles + 1, spectrum.gain
    local = uniform_filter1d(spectrum.power, width, mode="reflect") / uniform_filter1d(gain, width, mode="reflect")
    return np.asarray(spectrum.power + (1.0 - gain) * local)
