"""What a recording must offer before its gap can be judged, and what it cannot show, in words."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import NothingToFit
from identification.gap.floor import Floor
from identification.gap.residual import Cycles
from identification.piece import Piece
from identification.recordings import Recording, Stretch

_FEWEST_CYCLES = 4
"""Cycles, or seconds where nothing repeats, below which nothing can be kept out of the fit."""
_CLIPPED = 5
"""[samples] in a row at the very extreme of the force that count as clipped."""
_MOST_CLIPPED = 0.2
"""[1] part of the samples that may be clipped."""
_FAST, _FASTEST = 0.5, 0.99
"""[1] of a stroke's largest speed, above which a damper slides; and the part of the samples that go slower than
that: a knock is faster than any stroke."""


def one_specimen(recordings: Sequence[Recording]) -> None:
    """Refuse logs of different dampers.

    Raises:
        NothingToFit: the logs name different specimens.
    """
    names = {r.metadata["run"].get("specimen", "") or "unknown" for r in recordings}
    if len(names) > 1:
        raise NothingToFit(
            f"the logs are of different specimens ({', '.join(sorted(names))}); diagnose each damper by itself"
        )


def without_clipping(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """The recordings with clipped force marked as not valid, and what to say of it.

    Raises:
        NothingToFit: most of the force is clipped.
    """
    cleaned, notes = [], []
    for recording in recordings:
        stretches = []
        for stretch in recording.stretches:
            clipped = _clipped(stretch.force)
            share = float(np.mean(clipped))
            if share > _MOST_CLIPPED:
                raise NothingToFit(
                    f"{recording.path.name}: {share:.0%} of the force stands at its largest value, "
                    f"{np.abs(stretch.force).max():.4g} N; the load cell's range is too small, record again"
                )
            if share > 0:
                notes.append(_said(stretch, clipped))
                valid = ~clipped if stretch.force_valid is None else stretch.force_valid & ~clipped
                stretch = replace(stretch, force_valid=valid)
            stretches.append(stretch)
        cleaned.append(replace(recording, stretches=tuple(stretches)))
    return cleaned, notes


def _clipped(force: Array) -> BoolArray:
    """(N,) True where the force stands still at its largest or smallest value for some samples in a row."""
    found = np.zeros(len(force), bool)
    for extreme in (force.max(), force.min()):
        at = np.abs(force - extreme) <= 1e-9 * float(np.ptp(force))
        edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]]).astype(int)))
        for start, stop in edges.reshape(-1, 2):
            if stop - start >= _CLIPPED:
                found |= at
                break
    return found if np.ptp(force) > 0 else np.zeros(len(force), bool)


def _said(stretch: Stretch, clipped: BoolArray) -> str:
    limit = float(np.abs(stretch.force[clipped]).max())
    return (
        f"{stretch.name}: the force is clipped at {limit:.4g} N in {np.mean(clipped):.1%} of the samples; left out"
    )


def sliding_recorded(pieces: Sequence[Piece]) -> None:
    """Refuse recordings whose force was measured in slow motion alone: nothing tells what the damper resists.

    Raises:
        NothingToFit: no sample at speed is measured.
    """
    speeds = [np.abs(p.stroke.velocity) for p in pieces]
    limits = [_FAST * float(np.quantile(v, _FASTEST)) for v in speeds]
    measured = zip(speeds, limits, pieces, strict=True)
    if not any(((v > limit) & (p.train > 0)).any() for v, limit, p in measured):
        raise NothingToFit(
            f"above {max(limits):.2g} m/s no force was recorded that counts (clipped or "
            "not measured), so that nothing tells what the damper resists there; record again with a larger range"
        )


def enough_cycles(cycles: Cycles) -> None:
    """Refuse what is too short to keep anything out of the fit.

    Raises:
        NothingToFit: fewer than four cycles.
    """
    if cycles.count < _FEWEST_CYCLES:
        raise NothingToFit(
            f"the recording holds {cycles.count} cycle{'s' if cycles.count != 1 else ''} of the stroke, and "
            f"a diagnosis needs {_FEWEST_CYCLES} to keep some out of its fits; record longer"
        )


def blind_spots(cycles: Cycles, floor: Floor) -> list[str]:
    """What these strokes cannot show, in words."""
    notes = []
    drives = {float(f"{c.drive:.2g}") for c in cycles.conditions}
    frequencies = {float(f"{c.frequency:.2g}") for c in cycles.conditions if c.frequency}
    amplitudes = {float(f"{c.amplitude:.2g}") for c in cycles.conditions}
    if len(drives) == 1:
        notes.append("one drive only: nothing in the coil can be seen")
    if len(frequencies) == 1:
        notes.append("one frequency only: a delay of the force, a moving mass and a soft fixture look alike")
    if len(amplitudes) == 1:
        notes.append("one amplitude only: a gas spring, an end stop and a bent displacement channel look alike")
    if floor.cycle_to_cycle is None:
        notes.append(f"the noise floor rests on high frequencies alone: {floor.how}")
    notes.append("a gain of the force or displacement channel is visible to calibration only")
    return notes
