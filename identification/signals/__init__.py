"""Recorded arrays to states: motion, drive, noise floor, data quality."""

from identification.signals.data_quality import (
    check_recordings,
    check_single_specimen,
    clean_recordings,
    describe_outlier_logs,
    mask_clipping,
)
from identification.signals.drive import average_drive_levels, bin_drive, estimate_drive_noise
from identification.signals.motion import estimate_motion, estimate_recorded_noise
from identification.signals.noise_floor import NoiseFloorEstimate, combine_floors, estimate_floor

__all__ = [
    "NoiseFloorEstimate",
    "average_drive_levels",
    "bin_drive",
    "check_recordings",
    "check_single_specimen",
    "clean_recordings",
    "combine_floors",
    "describe_outlier_logs",
    "estimate_drive_noise",
    "estimate_floor",
    "estimate_motion",
    "estimate_recorded_noise",
    "mask_clipping",
]
