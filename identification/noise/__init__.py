"""Noise of the recorded force: its floor, with an interval, from the recording alone."""

from identification.noise.high_frequency import estimate_high_frequency_noise
from identification.noise.noise_floor import NoiseFloorEstimate, estimate_floor

__all__ = ["NoiseFloorEstimate", "estimate_floor", "estimate_high_frequency_noise"]
