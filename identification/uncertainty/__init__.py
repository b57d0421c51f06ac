"""Covariances, intervals and agreement of estimates."""

from identification.uncertainty.agreement import MAX_DEVIATION, Agreement, compare_estimates
from identification.uncertainty.clock_drift import (
    compute_drift_correction,
    correct_clock_drift,
    describe_clock_drift,
)
from identification.uncertainty.covariance import (
    MIN_INFORMATION,
    Covariance,
    compute_coordinate_covariance,
    estimate_covariance,
    find_strong_correlations,
    find_unobservable,
)
from identification.uncertainty.estimates import (
    GAUGE_NOTE,
    make_coordinate_estimates,
    make_delay_estimate,
    make_parameter_estimates,
    make_per_log_estimate,
)
from identification.uncertainty.input_noise import (
    reestimate_motion,
    remove_bias,
    replace_motion,
    resample_input_noise,
)
from identification.uncertainty.interval import Z95, Z95_ROUNDED, Z99, clip_interval, make_interval
from identification.uncertainty.profile import compute_profile_intervals
from identification.uncertainty.step_instants import estimate_step_shifts, shift_steps

__all__ = [
    "GAUGE_NOTE",
    "MAX_DEVIATION",
    "MIN_INFORMATION",
    "Z95",
    "Z95_ROUNDED",
    "Z99",
    "Agreement",
    "Covariance",
    "clip_interval",
    "compare_estimates",
    "compute_coordinate_covariance",
    "compute_drift_correction",
    "compute_profile_intervals",
    "correct_clock_drift",
    "describe_clock_drift",
    "estimate_covariance",
    "estimate_step_shifts",
    "find_strong_correlations",
    "find_unobservable",
    "make_coordinate_estimates",
    "make_delay_estimate",
    "make_interval",
    "make_parameter_estimates",
    "make_per_log_estimate",
    "reestimate_motion",
    "remove_bias",
    "replace_motion",
    "resample_input_noise",
    "shift_steps",
]
