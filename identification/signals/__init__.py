"""Recorded arrays to states: motion, drive, data quality."""

from identification.signals.data_quality import (
    check_recordings,
    check_single_specimen,
    clean_recordings,
    describe_outlier_logs,
    mask_invalid_samples,
)
from identification.signals.drive import (
    StepShifts,
    average_drive_levels,
    bin_drive,
    estimate_drive_noise,
    find_level_changes,
)
from identification.signals.harmonics import find_steady_cycles
from identification.signals.motion import Motion, estimate_motion, estimate_recorded_noise
from identification.signals.noise import estimate_white_noise
from identification.signals.smoother import differentiate, smooth_below

__all__ = [
    "Motion",
    "StepShifts",
    "average_drive_levels",
    "bin_drive",
    "check_recordings",
    "check_single_specimen",
    "clean_recordings",
    "describe_outlier_logs",
    "differentiate",
    "estimate_drive_noise",
    "estimate_motion",
    "estimate_recorded_noise",
    "estimate_white_noise",
    "find_level_changes",
    "find_steady_cycles",
    "mask_invalid_samples",
    "smooth_below",
]
