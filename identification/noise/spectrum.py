"""Spectrum of the noise in repeated windows, completed where the windows' fits remove it.

A fit removes the noise at the harmonics of the stroke and at the lowest frequencies. At the harmonics, the missing
part is taken from the frequencies around them. Below the lowest bins of a window, the spectrum is the smooth one
that all windows of the stretch have in common, down to one cycle in the whole recording. Elsewhere no form of the
spectrum is assumed.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import nnls

from identification.arrays import Array, BoolArray
from identification.noise.repeated_windows import RepeatedWindow
from identification.noise.smooth_spectrum import MissingPart, SmoothSpectrum
from identification.noise.time_scales import ScaleVariance, compute_deviations, compute_gain, list_scales
from identification.noise.window_fit import WindowFit

_KNOWN_GAIN = 0.2
"""Gain from which a bin shows the noise itself [1]; below, it rather shows what leaks from other frequencies."""
_LOW_DECADE = 10.0
"""Ratio of the highest to the lowest frequency that determine the 1/f part [1]."""
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


class WindowNoise(NamedTuple):
    """Noise of one window."""

    variance: float
    """Variance of the noise [N²]."""
    deviation: float
    """Standard deviation of that variance where the spectrum was observed [N²]."""
    extrapolated: float
    """Standard deviation of the part of the variance below the observed frequencies [N²]."""
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


def collect_known_bins(spectra: Sequence[WindowSpectrum]) -> tuple[Array, Array, Array]:
    """Return frequency [Hz], power [N²] and gain (B,) of all bins that show the noise itself."""
    columns = [np.stack([s.frequency, s.power, s.gain])[:, s.is_known] for s in spectra]
    frequency, power, gain = np.concatenate(columns, axis=1)
    return frequency, power, gain


def fit_low_frequency_spectrum(spectra: Sequence[WindowSpectrum]) -> LowFrequencySpectrum:
    """Fit the spectrum to the lowest decade that the spectra of one stretch show, by maximum likelihood."""
    frequency, power, gain = collect_known_bins(spectra)
    power = power / gain
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


def estimate_window_noise(spectrum: WindowSpectrum, smooth: SmoothSpectrum, duration: float) -> WindowNoise:
    """Return the noise of a window.

    Args:
        spectrum: its spectrum, which shows the noise itself in some bin.
        smooth: smooth spectrum of the noise of its stretch.
        duration: duration of the whole recording [s], whose mean is not noise.
    """
    count, lowest = len(spectrum.window.force), spectrum.lowest_known
    missing = MissingPart(smooth, spectrum.frequency[: lowest + 1], count, duration)
    values = _fill_harmonics(spectrum)
    values[:lowest] = missing.power
    last = values[-1] if count % 2 == 0 else 0.0
    samples = int(np.count_nonzero(spectrum.window.valid))
    bins = np.arange(len(values)) / count
    scales = []
    for m in list_scales(samples):
        # A scale contains nothing of the mean of a window.
        gain = np.where(bins > 0.0, compute_gain(bins, m), 0.0)
        deviation, extrapolated = (
            _compute_deviation(gain * values, spectrum),
            missing.compute_deviation(gain[:lowest]),
        )
        scales.append(ScaleVariance(m, 2.0 * float(gain @ values) / count, deviation, extrapolated))
    return WindowNoise(
        float(2.0 * values.sum() - last) / count,
        _compute_deviation(values, spectrum),
        missing.compute_deviation(np.ones(lowest)),
        samples,
        spectrum.window.cycles,
        tuple(scales),
    )


def _compute_deviation(values: Array, spectrum: WindowSpectrum) -> float:
    """Return the standard deviation [N²] of the variance of noise with the power ``values`` (N // 2 + 1,) [N²]."""
    smooth = uniform_filter1d(values, min(_SMOOTHED_BINS, len(values)), mode="nearest")[1:]
    return 2.0 * float(np.sqrt((smooth**2).sum() / spectrum.gain[1:].mean())) / len(spectrum.window.force)


def _fill_harmonics(spectrum: WindowSpectrum) -> Array:
    """Return the power (N // 2 + 1,) [N²] with the removed part from the frequencies around."""
    width, gain = 2 * spectrum.window.cycles + 1, spectrum.gain
    local = uniform_filter1d(spectrum.power, width, mode="reflect") / uniform_filter1d(gain, width, mode="reflect")
    return np.asarray(spectrum.power + (1.0 - gain) * local)
