"""Noise of the recorded force: its floor, with an interval, from the recording alone."""

from identification.noise.high_frequency import estimate_high_frequency_noise
from identification.noise.noise_floor import NoiseFloorEstimate, estimate_floor
from identification.noise.time_scales import (
    NO_SLOW_VARIANCE,
    NORMAL_95,
    ScaleVariance,
    SlowVariance,
    estimate_slow_variance,
    list_scales,
    measure_scale_variance,
)
from identification.noise.whitening import WhiteningFilter, design_whitening_filter

__all__ = [
    "NORMAL_95",
    "NO_SLOW_VARIANCE",
    "NoiseFloorEstimate",
    "ScaleVariance",
    "SlowVariance",
    "WhiteningFilter",
    "design_whitening_filter",
    "estimate_floor",
    "estimate_high_frequency_noise",
    "estimate_slow_variance",
    "list_scales",
    "measure_scale_variance",
]
