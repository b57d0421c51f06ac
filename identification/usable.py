"""What recordings must offer before a damper is sought in them, and what is left out of them, in words.

What cannot tell of a damper is refused with the reason. Single samples that no damper makes (spikes, a force that
stands still while the rod moves, a clipped force) are left out and said: least squares would follow each of them.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter, percentile_filter

from identification.arrays import Array, BoolArray
from identification.errors import NothingToFit
from identification.motion import recorded_noise
from identification.recordings import Recording, Segment, Stretch

FEWEST_A_CYCLE = 10.0
"""[1] samples a cycle of the motion below which the law cannot be followed between samples."""
_MOVES = 20.0
"""[1] deviations of the displacement's noise within which a damper counts as standing still."""
_STILL = 2e-4
"""[m] above which it moves, however coarse the samples are."""
_DRIVES = -0.3
"""[1] correlation of force and velocity below which a damper would have to drive its actuator."""
_CHANGES = 5.0
"""[1] deviations of the force's noise within which a force counts as none."""
_AROUND, _WIDER = 11, 41
"""[samples] windows of the usual value and of the usual spread around a sample."""
_SPIKE, _STEEP = 12.0, 4.0
"""[1] a spike is so many noises, and so many spreads of what is around it, off."""
_STUCK = 20
"""[samples] of one value, while the rod moves, that make a channel stuck."""
_CLIPPED = 5
"""[samples] in a row at the very extreme of the force that count as clipped."""
_LONGER = 5.0
"""[1] times the usual length of a run of one value that a stuck one is at least."""
_STROKE = 0.02
"""[1] of the whole stroke that the rod must move meanwhile."""
_MOST = 0.2
"""[1] part of the samples that may be left out of a stretch."""
_MISFIT, _STRANGE = 1.2, 2.0
"""[1] force error over the floor, and over that of the best log, above which a log counts as a stranger."""


def usable(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """The recordings without samples that no damper makes, and what a person should know of them.

    Raises:
        NothingToFit: the logs name different specimens, nothing moves, no force changes, the samples are too far
            apart, or too many of them are broken.
    """
    _one_specimen(recordings)
    _numbers(recordings)
    notes: list[str] = []
    cleaned = [
        replace(r, stretches=tuple(_mended(s, r.path.name, notes) for s in r.stretches)) for r in recordings
    ]
    stretches = [s for r in cleaned for s in r.stretches]
    _moving(stretches)
    _forceful(stretches)
    _passive(stretches)
    return cleaned, [*notes, *_blind_spots(stretches)]


def refuse_useless(recordings: Sequence[Recording]) -> None:
    """Refuse recordings that cannot tell of a damper, whatever is left out of them.

    Raises:
        NothingToFit: samples are no numbers, nothing moves, no force changes or resists, or the samples are too
            far apart.
    """
    _numbers(recordings)
    stretches = [s for r in recordings for s in r.stretches]
    _moving(stretches)
    _forceful(stretches)
    _passive(stretches)


def _one_specimen(recordings: Sequence[Recording]) -> None:
    names = {r.metadata["run"].get("specimen", "") for r in recordings}
    if len(names) > 1:
        listed = ", ".join(sorted(name or "one without a name" for name in names))
        raise NothingToFit(f"the logs are of different specimens ({listed}); fit each damper by itself")


def _numbers(recordings: Sequence[Recording]) -> None:
    for r in recordings:
        for s in r.stretches:
            for name, values in (("displacement", s.displacement), ("force", s.force), ("coil_drive", s.drive)):
                if not np.isfinite(values).all():
                    lost = int(np.sum(~np.isfinite(values)))
                    raise NothingToFit(
                        f"{r.path.name}, {s.name}: {lost} of {len(values)} samples of {name} are no numbers; "
                        "record again or leave them out"
                    )


def _mended(stretch: Stretch, log: str, notes: list[str]) -> Stretch:
    """The stretch with broken samples bridged and marked; says so in the notes."""
    force = stretch.force
    faults = {
        "displacement is spikes": _jumps(stretch.displacement),
        "force is spikes, or stands still while the damper moves": _spikes(force) | _stuck(stretch),
        f"force is clipped at {np.abs(force).max():.4g} N": _clipped(force),
    }
    for words, bad in faults.items():
        if bad.mean() > _MOST:
            raise NothingToFit(
                f"{log}, {stretch.name}: {bad.mean():.0%} of the {words}; check the sensor and its range, "
                "and record again"
            )
        if bad.any():
            notes.append(f"{stretch.name}: left out {bad.mean():.2%} of the samples, {words} there")
    bad_x, bad_f, clipped = faults.values()
    if not (bad_x | bad_f | clipped).any():
        return stretch
    valid = ~(bad_f | clipped)
    return replace(
        stretch,
        displacement=_bridged(stretch.displacement, bad_x),
        force=_bridged(force, bad_f),
        measured=stretch.measured & ~bad_x,
        force_valid=valid if stretch.force_valid is None else stretch.force_valid & valid,
    )


def _noise(values: Array) -> float:
    """Standard deviation of white noise in a signal (N,), by the median of its fourth differences."""
    # 0.6745: median of a Gaussian's magnitude; 70: variance of its fourth difference.
    return float(np.median(np.abs(np.diff(values, 4)))) / 0.6745 / np.sqrt(70.0) if len(values) > 4 else 0.0


def _spikes(values: Array) -> BoolArray:
    """(N,) True where a few samples stand far off everything around them; a corner does not."""
    off = np.abs(values - median_filter(values, _AROUND, mode="nearest"))
    return _beyond(off, _SPIKE * _noise(values), values)


def _jumps(values: Array) -> BoolArray:
    """(N,) True where a displacement leaves the line between its neighbours as no mass can move."""
    off = np.zeros(len(values))
    off[1:-1] = values[1:-1] - 0.5 * (values[:-2] + values[2:])
    size = np.abs(off)
    # The neighbours of a jump leave their lines, too, by half as much: only the largest of the three is broken.
    largest = size >= np.maximum(np.roll(size, 1), np.roll(size, -1))
    return _beyond(size, _SPIKE * _noise(values), off) & largest


def _beyond(off: Array, least: float, values: Array) -> BoolArray:
    """Where something is off by more than the least, and by more than the values spread around it."""
    # A coarse converter may show no noise at all: two of its steps are no spike yet.
    steps = np.diff(np.unique(values[:5000]))
    least = max(least, 2.0 * float(np.min(steps, initial=np.inf, where=steps > 0)))
    if not np.isfinite(least) or not (off > least).any():
        return np.zeros(len(values), bool)
    # Quartiles: the spike itself must not widen the spread that it is measured by.
    upper, lower = (percentile_filter(values, part, _WIDER, mode="nearest") for part in (75, 25))
    return np.asarray(off > least + _STEEP * (upper - lower))


def _stuck(stretch: Stretch) -> BoolArray:
    """(N,) True where the force keeps one value while the rod moves; at its extremes it is clipped instead."""
    force, found = stretch.force, np.zeros(len(stretch.force), bool)
    needed, extremes = _STROKE * float(np.ptp(stretch.displacement)), (force.min(), force.max())
    for start, stop in _long_runs(force, _STUCK):
        if force[start] not in extremes and np.ptp(stretch.displacement[start:stop]) > needed:
            found[start:stop] = True
    return found


def _clipped(force: Array) -> BoolArray:
    """(N,) True where the force stands still at its largest or smallest value."""
    found, extremes = np.zeros(len(force), bool), (force.min(), force.max())
    for start, _ in _long_runs(force, _CLIPPED):
        if force[start] in extremes:
            # Once a run shows the limit, single samples there are clipped as well.
            found |= force == force[start]
    return found


def _long_runs(force: Array, least: int) -> list[tuple[int, int]]:
    """Runs of one value, longer than the least and far longer than usual: a coarse converter has runs, too."""
    if np.ptp(force) == 0.0:
        return []
    edges = np.concatenate([[0], np.flatnonzero(np.diff(force) != 0.0) + 1, [len(force)]])
    longest = max(least, _LONGER * float(np.quantile(np.diff(edges), 0.99)))
    return [(int(start), int(stop)) for start, stop in itertools.pairwise(edges) if stop - start >= longest]


def _bridged(values: Array, bad: BoolArray) -> Array:
    """The signal (N,) with straight lines over what is broken."""
    if not bad.any():
        return values
    place = np.arange(len(values))
    return np.interp(place, place[~bad], values[~bad])


def _moving(stretches: Sequence[Stretch]) -> None:
    """Refuse a damper that stands still, and one whose motion is lost between the samples."""
    travel = max(float(np.ptp(s.displacement)) for s in stretches)
    noise = min(recorded_noise(s) for s in stretches)
    if travel <= max(min(_MOVES * noise, _STILL), 0.0):
        raise NothingToFit(
            f"the damper stands still: its displacement stays within {1e6 * travel:.3g} µm, and its noise is "
            f"{1e6 * noise:.2g} µm; record strokes"
        )
    for s in stretches:
        if float(np.ptp(s.displacement)) > _STROKE * travel:
            _dense(s)


def _forceful(stretches: Sequence[Stretch]) -> None:
    change = max(float(s.force.std()) for s in stretches)
    noise = min(_noise(s.force) for s in stretches)
    if change <= _CHANGES * noise or change <= 0.0:
        raise NothingToFit(
            f"the force hardly changes: its deviation is {change:.3g} N, and its noise {noise:.2g} N; check the "
            "load cell, its cable and its range"
        )


def _passive(stretches: Sequence[Stretch]) -> None:
    """Refuse a force that drives the motion."""
    velocity = np.concatenate([np.gradient(s.displacement) * s.rate for s in stretches])
    force = np.concatenate([s.force - s.force.mean() for s in stretches])
    size = float(np.sqrt(np.mean(velocity**2) * np.mean(force**2)))
    together = float(np.mean(velocity * force)) / max(size, 1e-300)
    if together < _DRIVES:
        raise NothingToFit(
            f"the force drives the motion instead of resisting it (correlation with the velocity {together:.2f}): "
            "one of the two has the other sign; extension and tension are positive"
        )


def _dense(stretch: Stretch) -> None:
    """Refuse too few samples a cycle, by how far the displacement goes from one sample to the next."""
    deviation = float(stretch.displacement.std())
    step = float(np.sqrt(np.mean(np.diff(stretch.displacement) ** 2)))
    if deviation <= 0.0 or step <= 0.0:
        return
    cycle = np.pi / np.arcsin(min(step / (2.0 * deviation), 1.0))
    if cycle < FEWEST_A_CYCLE:
        raise NothingToFit(
            f"{stretch.name}: {cycle:.2g} samples a cycle of the motion, and the law needs {FEWEST_A_CYCLE:g} to "
            f"be followed between them; record at {stretch.rate * FEWEST_A_CYCLE / cycle:.0f} Hz or more, "
            f"not at {stretch.rate:.4g} Hz"
        )


def _blind_spots(stretches: Sequence[Stretch]) -> list[str]:
    """What these strokes cannot show, as far as their plan tells it."""
    notes = []
    drives = np.concatenate([s.drive for s in stretches])
    if float(np.ptp(drives)) < 1e-9:
        notes.append(
            f"the drive never changes ({drives[0]:.3g}): eta and all that grows with the drive stay unseen"
        )
    segments = [g for s in stretches for g in s.segments]
    strokes = {_stroke(g) for g in segments}
    if len(strokes) == 1 and (stroke := strokes.pop()) is not None:
        amplitude, frequency = stroke
        notes.append(
            f"all strokes are alike ({1e3 * amplitude:.3g} mm, {frequency:.3g} Hz): what the fit says of others "
            "is not tested here"
        )
    return notes


def _stroke(segment: Segment) -> tuple[float, float] | None:
    """Amplitude [m] and frequency [Hz] of a segment, where it has both."""
    if segment.amplitude is None or segment.frequency is None:
        return None
    return round(segment.amplitude, 5), round(segment.frequency, 3)


def strangers(names: Sequence[str], errors: Sequence[Array], ratio: float) -> list[str]:
    """Logs that the common damper fits much worse than the others, in words.

    Args:
        names: of the log behind each stretch.
        errors: force error (N,) [N] of each stretch.
        ratio: [1] force error of the whole fit over its noise floor.
    """
    logs = list(dict.fromkeys(names))
    if len(logs) < 2 or ratio < _MISFIT:
        return []
    size = {}
    for log in logs:
        mine = np.concatenate([e for e, name in zip(errors, names, strict=True) if name == log])
        size[log] = float(np.sqrt(np.mean(mine**2)))
    best = min(size.values())
    return [
        f"{log}: force error {error:.3g} N, {error / best:.2g} times that of the log that fits best: another "
        "damper, or other conditions; fit it apart"
        for log, error in size.items()
        if error > _STRANGE * best
    ]
