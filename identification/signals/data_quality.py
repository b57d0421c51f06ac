"""Checks of recordings before a fit, and exclusion of their invalid samples.

A recording that cannot determine a damper is refused with the reason. Invalid samples are excluded with a note.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import UnusableDataError
from identification.logs import Recording, Segment, Stretch
from identification.signals.invalid_samples import (
    STROKE_FRACTION,
    find_clipped_runs,
    find_clipping,
    find_jumps,
    find_spikes,
    find_stuck_force,
    interpolate_invalid,
)
from identification.signals.motion import estimate_recorded_noise
from identification.signals.noise import estimate_white_noise

_MIN_SAMPLES_PER_CYCLE = 10.0
"""Samples in a cycle of the motion: with fewer, the law cannot be followed between samples."""
_MOTION_RATIO = 20.0
"""Threshold on travel over displacement noise: below it, a damper stands still."""
_STANDSTILL_LIMIT = 2e-4
"""Travel [m] above which a damper moves, however large the displacement noise."""
_ACTIVE_CORRELATION = -0.3
"""Threshold on the correlation of force and velocity: below it, the damper would drive its actuator."""
_FORCE_RATIO = 5.0
"""Threshold on the force's deviation over its noise: below it, no force was recorded."""
_MAX_EXCLUDED = 0.2
"""Threshold on the share of invalid samples: above it, the recording is refused."""
_MISFIT_RATIO, _OUTLIER_RATIO = 1.2, 2.0
"""Thresholds on the force error over the noise floor, and of a log over that of the best log: above both, the log
is an outlier."""


def clean_recordings(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """Return the recordings with invalid samples excluded, and notes about them and about the strokes.

    Raises:
        UnusableDataError: the logs name different specimens, nothing moves, no force changes, the sampling is too
            slow, or too many samples are invalid.
    """
    check_single_specimen(recordings, "fit")
    _check_finite(recordings)
    notes: list[str] = []
    cleaned = [
        replace(r, stretches=tuple(_clean_stretch(s, r.path.name, notes) for s in r.stretches)) for r in recordings
    ]
    stretches = [s for r in cleaned for s in r.stretches]
    _check_signals(stretches)
    return cleaned, [*notes, *_describe_limitations(stretches)]


def check_recordings(recordings: Sequence[Recording]) -> None:
    """Check that recordings can determine a damper.

    Raises:
        UnusableDataError: samples are not finite, nothing moves, no force changes or resists the motion, or the
            sampling is too slow.
    """
    _check_finite(recordings)
    _check_signals([s for r in recordings for s in r.stretches])


def check_single_specimen(recordings: Sequence[Recording], action: str) -> None:
    """Check that all logs are of one damper; ``action`` is the verb of the message.

    Raises:
        UnusableDataError: the logs name different specimens.
    """
    names = {r.metadata["run"].get("specimen", "") for r in recordings}
    if len(names) > 1:
        listed = ", ".join(sorted(name or "one without a name" for name in names))
        raise UnusableDataError(f"the logs are of different specimens ({listed}); {action} each damper separately")


def mask_invalid_samples(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """Return the recordings of a diagnosis with invalid samples excluded, and notes about them.

    Spikes, jumps and stuck values are those of `clean_recordings`. Samples at an extreme of the force count as
    clipped after fewer repeats, because a gap at the extremes could be taken for an effect.

    Raises:
        UnusableDataError: too many samples are invalid.
    """
    notes: list[str] = []
    cleaned = [
        replace(r, stretches=tuple(_mask_invalid_stretch(s, r.path.name, notes) for s in r.stretches))
        for r in recordings
    ]
    return cleaned, notes


def _mask_invalid_stretch(stretch: Stretch, log: str, notes: list[str]) -> Stretch:
    clipped = np.zeros(len(stretch.force), bool)
    return _mask_clipped_force(_exclude_samples(stretch, clipped, log, notes), log, notes)


def _mask_clipped_force(stretch: Stretch, log: str, notes: list[str]) -> Stretch:
    clipped = find_clipping(stretch.force)
    share = float(np.mean(clipped))
    if share > _MAX_EXCLUDED:
        raise UnusableDataError(
            f"{log}: {share:.0%} of the force samples are clipped at {np.abs(stretch.force).max():.4g} N "
            f"(limit {_MAX_EXCLUDED:.0%}); record again with a larger range of the load cell"
        )
    if share == 0:
        return stretch
    limit = float(np.abs(stretch.force[clipped]).max())
    notes.append(
        f"{stretch.name}: the force is clipped at {limit:.4g} N in {np.mean(clipped):.1%} of the samples; "
        "these samples were excluded"
    )
    valid = ~clipped if stretch.force_valid is None else stretch.force_valid & ~clipped
    return replace(stretch, force_valid=valid)


def _check_finite(recordings: Sequence[Recording]) -> None:
    for r in recordings:
        for s in r.stretches:
            for name, values in (("displacement", s.displacement), ("force", s.force), ("coil_drive", s.drive)):
                if not np.isfinite(values).all():
                    count = int(np.sum(~np.isfinite(values)))
                    raise UnusableDataError(
                        f"{r.path.name}, {s.name}: {count} of {len(values)} samples of {name} are not finite; "
                        "record again or remove them"
                    )


def _clean_stretch(stretch: Stretch, log: str, notes: list[str]) -> Stretch:
    return _exclude_samples(stretch, find_clipped_runs(stretch.force), log, notes)


def _exclude_samples(stretch: Stretch, clipped: BoolArray, log: str, notes: list[str]) -> Stretch:
    """Return the stretch with invalid samples bridged and marked, and add notes about them.

    ``clipped`` is a mask (N,) of clipped samples of the force.
    """
    force = stretch.force
    invalid_x, invalid_f = find_jumps(stretch.displacement), find_spikes(force) | find_stuck_force(stretch)
    faults = {
        "displacement samples are spikes": invalid_x,
        "force samples are spikes, or constant while the damper moves": invalid_f,
        f"force samples are clipped at {np.abs(force).max():.4g} N": clipped,
    }
    for fault, mask in faults.items():
        if mask.mean() > _MAX_EXCLUDED:
            raise UnusableDataError(
                f"{log}, {stretch.name}: {mask.mean():.0%} of the {fault} (limit {_MAX_EXCLUDED:.0%}); check the "
                "sensor and its range, and record again"
            )
        if mask.any():
            notes.append(f"{stretch.name}: {mask.mean():.2%} of the {fault}; these samples were excluded")
    if not (invalid_x | invalid_f | clipped).any():
        return stretch
    valid = ~(invalid_f | clipped)
    return replace(
        stretch,
        displacement=interpolate_invalid(stretch.displacement, invalid_x),
        force=interpolate_invalid(force, invalid_f),
        measured=stretch.measured & ~invalid_x,
        force_valid=valid if stretch.force_valid is None else stretch.force_valid & valid,
    )


def _check_signals(stretches: Sequence[Stretch]) -> None:
    _check_motion(stretches)
    _check_force(stretches)
    _check_passivity(stretches)


def _check_motion(stretches: Sequence[Stretch]) -> None:
    """Refuse a damper that stands still, and sampling that is too slow for its motion."""
    travel = max(float(np.ptp(s.displacement)) for s in stretches)
    noise = min(estimate_recorded_noise(s) for s in stretches)
    if travel <= max(min(_MOTION_RATIO * noise, _STANDSTILL_LIMIT), 0.0):
        raise UnusableDataError(
            f"the damper stands still: its displacement varies by {1e6 * travel:.3g} µm with a noise of "
            f"{1e6 * noise:.2g} µm; record strokes"
        )
    for s in stretches:
        if float(np.ptp(s.displacement)) > STROKE_FRACTION * travel:
            _check_sampling(s)


def _estimate_force_noise(force: Array) -> float:
    """Return the noise of a force [N]; a mains line near half the sampling rate is no noise."""
    pairs = force[: len(force) // 2 * 2].reshape(-1, 2).mean(axis=1)
    return min(estimate_white_noise(force, 4), math.sqrt(2.0) * estimate_white_noise(pairs, 4))


def _check_force(stretches: Sequence[Stretch]) -> None:
    deviation = max(float(s.force.std()) for s in stretches)
    noise = min(_estimate_force_noise(s.force) for s in stretches)
    if deviation <= _FORCE_RATIO * noise or deviation <= 0.0:
        raise UnusableDataError(
            f"the force hardly changes: its standard deviation is {deviation:.3g} N with a noise of "
            f"{noise:.2g} N; check the load cell, its cable and its range"
        )


def _check_passivity(stretches: Sequence[Stretch]) -> None:
    """Refuse a force that drives the motion."""
    velocity = np.concatenate([np.gradient(s.displacement) * s.rate for s in stretches])
    force = np.concatenate([s.force - s.force.mean() for s in stretches])
    size = float(np.sqrt(np.mean(velocity**2) * np.mean(force**2)))
    correlation = float(np.mean(velocity * force)) / max(size, 1e-300)
    if correlation < _ACTIVE_CORRELATION:
        raise UnusableDataError(
            "the force drives the motion instead of resisting it (correlation with the velocity "
            f"{correlation:.2f}): one of the two has the wrong sign; extension and tension are positive. "
            "`mrbench import --reverse force_n` reverses a recording of another machine"
        )


def _check_sampling(stretch: Stretch) -> None:
    """Refuse too few samples in a cycle, estimated from the displacement between samples."""
    deviation = float(stretch.displacement.std())
    step = float(np.sqrt(np.mean(np.diff(stretch.displacement) ** 2)))
    if deviation <= 0.0 or step <= 0.0:
        return
    cycle = np.pi / np.arcsin(min(step / (2.0 * deviation), 1.0))
    if cycle < _MIN_SAMPLES_PER_CYCLE:
        raise UnusableDataError(
            f"{stretch.name}: {cycle:.2g} samples a cycle of the motion are too few, the law needs "
            f"{_MIN_SAMPLES_PER_CYCLE:g}; record at {stretch.rate * _MIN_SAMPLES_PER_CYCLE / cycle:.0f} Hz or "
            f"more, not at {stretch.rate:.4g} Hz"
        )


def _describe_limitations(stretches: Sequence[Stretch]) -> list[str]:
    """Return notes about coordinates and strokes that the planned strokes do not cover."""
    notes = []
    drives = np.concatenate([s.drive for s in stretches])
    if float(np.ptp(drives)) < 1e-9:
        notes.append(
            f"the drive never changes ({drives[0]:.3g}): eta and all slopes over the drive are not observable"
        )
    strokes = {_get_stroke(g) for s in stretches for g in s.segments}
    if len(strokes) == 1 and (stroke := strokes.pop()) is not None:
        amplitude, frequency = stroke
        notes.append(
            f"all strokes are alike ({1e3 * amplitude:.3g} mm, {frequency:.3g} Hz): the fit is untested on others"
        )
    return notes


def _get_stroke(segment: Segment) -> tuple[float, float] | None:
    """Return amplitude [m] and frequency [Hz] of a segment, if it has both."""
    if segment.amplitude is None or segment.frequency is None:
        return None
    return round(segment.amplitude, 5), round(segment.frequency, 3)


def describe_outlier_logs(names: Sequence[str], errors: Sequence[Array], ratio: float) -> list[str]:
    """Return notes about logs that the common damper fits much worse than the others.

    Args:
        names: name of the log of each stretch.
        errors: force error (N,) [N] of each stretch.
        ratio: force error of the whole fit over its noise floor (dimensionless).
    """
    if len(set(names)) < 2 or ratio < _MISFIT_RATIO:
        return []
    rmse = {log: _compute_log_rmse(log, names, errors) for log in dict.fromkeys(names)}
    best = min(rmse.values())
    return [
        f"{log}: force error {error:.3g} N, {error / best:.2g} times that of the best log: another damper or "
        "other conditions; fit it separately"
        for log, error in rmse.items()
        if error > _OUTLIER_RATIO * best
    ]


def _compute_log_rmse(log: str, names: Sequence[str], errors: Sequence[Array]) -> float:
    log_errors = np.concatenate([e for e, name in zip(errors, names, strict=True) if name == log])
    return float(np.sqrt(np.mean(log_errors**2)))
