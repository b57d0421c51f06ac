"""Noise of force and displacement as the diagnosis estimates it."""

from identification.gap.noise.clock_drift import describe_drift_explanation, subtract_clock_drift
from identification.gap.noise.noise_model import NoiseModel
from identification.gap.noise.slow_drift import compute_noise_drift
from identification.gap.noise.spectral_line import MAINS_FREQUENCY, find_mains_frequency

__all__ = [
    "MAINS_FREQUENCY",
    "NoiseModel",
    "compute_noise_drift",
    "describe_drift_explanation",
    "find_mains_frequency",
    "subtract_clock_drift",
]
