"""Dataset: recordings with smoothed motion, known delays and masks, ready to be simulated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from typing import Any

import numpy as np
import orjson

from identification.arrays import BoolArray
from identification.errors import UnusableDataError
from identification.fitting.force_channel import LowPass, compute_filter_delay
from identification.fitting.piece import Piece
from identification.logs import Recording, Stretch
from identification.noise import NoiseFloorEstimate, estimate_floor
from identification.signals import Motion, average_drive_levels, estimate_motion
from identification.simulate import Excitation

_TRANSIENT_TIME = 0.02
"""Time [s] at the start of a stretch in which the unknown hysteretic state decays; it is not fitted."""
_MAX_EXCLUDED = 0.5
"""Threshold on the unresolved part of a stretch: above it, nothing is excluded."""
_MIN_SAMPLES = 200
"""Smallest number of samples for a fit."""
_MIN_FLOOR_SAMPLES = 10
"""Number of measured samples of a stretch above which its noise is estimated: fourth differences need some."""
_FILTER_RATE = 4000.0
"""Rate [Hz] at which the force is simulated before a filter."""
_TIMED_CHANNELS = {"force", "displacement", "coil_voltage", "coil_current"}
"""Channels between which a delay matters."""
_MAPPED_CLOCK_ERROR = 20e-6
"""Standard deviation [s] between two device clocks that were mapped onto the bench clock."""


@dataclass(frozen=True)
class HoldOut:
    """Selection of the samples that are held out of a fit."""

    patterns: tuple[str, ...] = ()
    """Names of stretches or segments, with wildcards."""
    after_fraction: float | None = None
    """Fraction of each stretch after which it is held out (dimensionless)."""

    @staticmethod
    def from_text(patterns: str, after_fraction: float | None = None) -> "HoldOut":
        """Return the selection by patterns that are separated by commas, and by a fraction of each stretch."""
        return HoldOut(tuple(name for name in patterns.split(",") if name), after_fraction)

    def make_mask(self, stretch: Stretch) -> BoolArray:
        """Return a mask (N,) of the held-out samples of a stretch."""
        count = len(stretch.time)
        mask = np.full(count, self._is_listed(stretch.name))
        for segment in stretch.segments:
            if self._is_listed(segment.name):
                mask[segment.start : segment.stop] = True
        if self.after_fraction is not None:
            mask[round(self.after_fraction * count) :] = True
        return mask

    def _is_listed(self, name: str) -> bool:
        return any(fnmatch(name, pattern) for pattern in self.patterns)


@dataclass(frozen=True)
class Dataset:
    """All stretches of some recordings, prepared for the fit."""

    pieces: tuple[Piece, ...]
    """``train`` marks the fitted samples."""
    held_out: tuple[BoolArray, ...]
    """(N,) held-out samples of each piece."""
    stretches: tuple[Stretch, ...]
    floor: NoiseFloorEstimate
    recordings: tuple[Recording, ...]
    notes: tuple[str, ...] = ()
    """Disturbances, as text."""
    hold_out: HoldOut = HoldOut()
    """Selection of the held-out samples."""

    @property
    def drive_unit(self) -> str:
        """V or A."""
        return self.recordings[0].drive_unit

    @property
    def delay_prior(self) -> float:
        """Standard deviation [s] of the delay between two channels."""
        return max(_estimate_clock_error(r) for r in self.recordings)

    @property
    def clock_deviation(self) -> float:
        """Standard deviation [s] of that delay by the clock error bounds in the logs; 0 if they have none."""
        return max(_combine_clock_errors(_find_clock_records(r)) for r in self.recordings)


def _estimate_clock_error(recording: Recording) -> float:
    """Return the standard deviation [s] of a delay: as mapped on a bench, else half the shortest sample."""
    if recording.metadata["run"].get("source") == "run":
        return max(_MAPPED_CLOCK_ERROR, _combine_clock_errors(_find_clock_records(recording)))
    # An imported recording has no clock records.
    return 0.5 / max(s.rate for s in recording.stretches)


def _find_clock_records(recording: Recording) -> Mapping[str, str]:
    """Return the clock records from the end of a log, where clocks are known best, else from its start."""
    metadata = recording.metadata
    # Logs until version 0.1.0 name the record clock_skew, and its bound skew_s.
    return metadata.get("clock_error_bounds") or metadata.get("clock_skew") or metadata.get("clocks", {})


def _combine_clock_errors(records: Mapping[str, str]) -> float:
    """Return the standard deviation [s] of the delay between channels, from the 95 % bounds of their clocks."""
    clocks = [_parse_clock_record(text) for text in records.values()]
    timed = [clock for clock in clocks if _TIMED_CHANNELS & set(clock.get("channels", ()))]
    bounds = sorted(clock.get("clock_error_bound_s") or clock.get("skew_s") or 0.0 for clock in timed)
    return float(np.hypot(bounds[-2], bounds[-1])) / 2 if len(bounds) > 1 else 0.0


def _parse_clock_record(text: str) -> dict[str, Any]:
    """Return the record of one clock; empty if it is text for a person."""
    try:
        record = orjson.loads(text)
    except orjson.JSONDecodeError:
        return {}
    return record if isinstance(record, dict) else {}


def assemble(
    recordings: Sequence[Recording], hold_out: HoldOut = HoldOut(), max_excluded: float = _MAX_EXCLUDED
) -> Dataset:
    """Smooth the motion of every stretch, and mark the fitted samples.

    Args:
        recordings: logs that are fitted together.
        hold_out: samples kept out of the fit.
        max_excluded: largest share of a stretch that disturbances may exclude [1].

    Raises:
        UnusableDataError: the logs have different kinds of drive, or the hold-out selects nothing or leaves too
            few samples.
    """
    _check_drive_kinds(recordings)
    stretches = [s for r in recordings for s in r.stretches]
    held_out = [hold_out.make_mask(s) for s in stretches]
    starts = [s.time[0] - r.stretches[0].time[0] for r in recordings for s in r.stretches]
    logs = [k for k, r in enumerate(recordings) for _ in r.stretches]
    pieces, motions, notes = [], [], list[str]()
    for k, (mask, start, log) in enumerate(zip(held_out, starts, logs, strict=True)):
        motion = estimate_motion(stretches[k])
        stretch = stretches[k] = _exclude_unresolved(stretches[k], motion.unresolved, max_excluded, notes)
        motions.append(motion)
        fitted = stretch.valid_mask & ~mask
        fitted[: round(_TRANSIENT_TIME * stretch.rate)] = False
        power = np.abs(stretch.force * motion.velocity)
        excitation = Excitation(
            stretch.rate, *motion[:3], average_drive_levels(stretch.drive), start=float(start), power=power
        )
        pieces.append(replace(_make_piece(stretch, excitation, fitted), log=log))
    _check_hold_out(hold_out, held_out, pieces)
    floor = _estimate_floor(stretches, held_out, motions)
    return Dataset(
        tuple(pieces), tuple(held_out), tuple(stretches), floor, tuple(recordings), tuple(notes), hold_out
    )


def _check_drive_kinds(recordings: Sequence[Recording]) -> None:
    kinds = {r.drive_kind for r in recordings}
    if len(kinds) > 1:
        raise UnusableDataError(
            f"the logs are driven in different ways ({', '.join(sorted(kinds))}); fit them separately"
        )


def _estimate_floor(
    stretches: Sequence[Stretch], held_out: Sequence[BoolArray], motions: Sequence[Motion]
) -> NoiseFloorEstimate:
    """Estimate the noise floor from the valid samples that are not held out."""
    read = [replace(s, measured=s.valid_mask & ~m) for s, m in zip(stretches, held_out, strict=True)]
    known = [k for k, s in enumerate(read) if np.count_nonzero(s.measured) > _MIN_FLOOR_SAMPLES]
    return estimate_floor([read[k] for k in known], [motions[k] for k in known])


def _exclude_unresolved(stretch: Stretch, unresolved: BoolArray, max_excluded: float, notes: list[str]) -> Stretch:
    """Mark the force of unresolved samples as invalid, unless they are most of the stretch, and add a note."""
    if not unresolved.any():
        return stretch
    note = f"{stretch.name}: disturbances (late setpoints or shocks) in {unresolved.mean():.2%} of the samples"
    if unresolved.mean() > max_excluded:
        notes.append(f"{note}, too many to exclude (limit {max_excluded:.0%}); record again")
        return stretch
    notes.append(f"{note}; these samples were excluded")
    valid = ~unresolved if stretch.force_valid is None else stretch.force_valid & ~unresolved
    return replace(stretch, force_valid=valid)


def _make_piece(stretch: Stretch, excitation: Excitation, fitted: BoolArray) -> Piece:
    # Strokes are slow: the displacement's filter counts as a delay. The force's is simulated (decision 0004).
    displacement_lag = stretch.displacement_delay + compute_filter_delay(stretch.displacement_filter)
    return Piece(
        name=stretch.name,
        excitation=excitation,
        force=stretch.force,
        train=fitted.astype(np.float64),
        force_delay=stretch.force_delay - displacement_lag,
        drive_delay=displacement_lag - stretch.drive_delay,
        low_pass=_make_low_pass(stretch),
    )


def _make_low_pass(stretch: Stretch) -> LowPass | None:
    """Return the force channel's filter, oversampled for a force that turns within a millisecond."""
    if stretch.force_filter is None:
        return None
    return LowPass(stretch.force_filter, stretch.rate, max(1, round(_FILTER_RATE / stretch.rate)))


def _check_hold_out(hold_out: HoldOut, held_out: Sequence[BoolArray], pieces: Sequence[Piece]) -> None:
    if hold_out.patterns and not any(mask.any() for mask in held_out):
        raise UnusableDataError(
            f"--hold-out {','.join(hold_out.patterns)} matches no stretch and no segment of these logs; give "
            "other names"
        )
    count = sum(p.train.sum() for p in pieces)
    if count < _MIN_SAMPLES:
        raise UnusableDataError(
            f"{count:.0f} samples remain for the fit, fewer than {_MIN_SAMPLES}; hold out fewer or record longer"
        )
