"""Noise of force and displacement as the diagnosis estimates it."""

from identification.gap.noise.clock_drift import describe_drift_explanation, subtract_clock_drift
from identification.gap.noise.explainable_share import FEATURE_VARIABLES, Explained, ResidualRegression
from identification.gap.noise.noise_model import NoiseModel
from identification.gap.noise.simulated_noise import compute_noise_evidence
from identification.gap.noise.slow_drift import DRIFT_CURVE, compute_noise_drift, has_drift
from identification.gap.noise.spectral_line import MAINS_FREQUENCY, find_mains_frequency
from identification.gap.noise.unpredicted_residual import (
    CHANCE_DEVIATIONS,
    compute_scatter,
    discard_unsteady_cycles,
    simulate_scatter,
    take_floor_from_residual,
)

__all__ = [
    "CHANCE_DEVIATIONS",
    "DRIFT_CURVE",
    "FEATURE_VARIABLES",
    "MAINS_FREQUENCY",
    "Explained",
    "NoiseModel",
    "ResidualRegression",
    "compute_noise_drift",
    "compute_noise_evidence",
    "compute_scatter",
    "describe_drift_explanation",
    "discard_unsteady_cycles",
    "find_mains_frequency",
    "has_drift",
    "simulate_scatter",
    "subtract_clock_drift",
    "take_floor_from_residual",
]
