"""Mean cycle of a periodic segment: its samples sorted by the phase of the displacement.

The phase is that of the sine of the segment's frequency that fits the displacement best. Time bases and sampling
rates of the runs need not agree.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bench.samples import SampleTable, SegmentRange

PHASES = 120
"""Number of phases of a mean cycle: each covers 3 degrees."""
_MIN_SAMPLES = 2 * PHASES
"""Number of samples in all cycles below which a mean cycle has empty phases."""
_WHOLE = 0.98
"""Share of its samples that a cycle needs to count as whole."""
_ROUNDING = 1e-9
"""Rounding errors of a phase [cycles], which must not decide where a sample at an edge belongs."""
_FULL_STROKE = 0.95
"""Share of the median stroke that a cycle needs; others belong to fades."""

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class MeanCycle:
    """Mean cycle of a segment; arrays over the phase have shape (PHASES,), those over the cycles (cycles,)."""

    displacement: Array
    """[m]"""
    velocity: Array
    """[m/s]"""
    force: Array
    """[N]"""
    strokes: Array
    """Half of the stroke of each cycle [m]."""
    peaks: Array
    """Smallest force, largest force [N] and largest speed [m/s] of each cycle, shape (3, cycles)."""
    energies: Array
    """Dissipated energy of each cycle [J]."""
    frequency: float
    """Frequency of the displacement [Hz]."""
    drive: float
    """Mean drive [V or A]."""
    temperature: float | None
    """Mean temperature [°C]; None if it was not measured."""


@dataclass(frozen=True)
class PhasedRows:
    """Samples of whole cycles of full stroke."""

    rows: npt.NDArray[np.int64]
    cycle: npt.NDArray[np.int64]
    """Number of the cycle of each sample, from 0."""
    phase: Array
    """Phase of each sample, 0 to PHASES."""
    frequency: float
    """[Hz]"""

    def average(self, values: Array) -> Array:
        """Return the mean at the middle of each phase, shape (PHASES,), of values at the samples.

        Samples of two runs are at different places within a phase. So means are interpolated from where they are.
        """
        place = self.phase.astype(np.int64) % PHASES
        count = np.bincount(place, minlength=PHASES)
        given = count > 0
        sums = (np.bincount(place, each, PHASES)[given] for each in (values, self.phase % PHASES))
        mean, middle = (one / count[given] for one in sums)
        curve: Array = np.interp(np.arange(PHASES) + 0.5, middle, mean, period=PHASES)
        return curve


def average_cycles(table: SampleTable, segment: SegmentRange) -> MeanCycle | None:
    """Return the mean cycle of a segment; None if it is not periodic or has no whole cycle."""
    phased = find_phases(table, segment)
    if phased is None:
        return None
    position, force, speed, drive = (
        table.columns[name][phased.rows].astype(np.float64)
        for name in ("displacement", "force", "velocity", "coil_drive")
    )
    first = _find_starts(phased.cycle)
    peaks = [np.minimum.reduceat(force, first), np.maximum.reduceat(force, first)]
    return MeanCycle(
        displacement=phased.average(position),
        velocity=phased.average(speed),
        force=phased.average(force),
        strokes=_find_strokes(position, first),
        peaks=np.array([*peaks, np.maximum.reduceat(np.abs(speed), first)]),
        energies=_integrate(force, position, phased.cycle),
        frequency=phased.frequency,
        drive=float(drive.mean()),
        temperature=_average_given(table, phased),
    )


def find_phases(table: SampleTable, segment: SegmentRange) -> PhasedRows | None:
    """Return the samples of the whole cycles of full stroke, with their phases; None without such cycles."""
    if not segment.frequency_hz or segment.samples < _MIN_SAMPLES:
        return None
    time = table.time[segment.rows] - table.time[segment.first]
    position = table.columns["displacement"][segment.rows].astype(np.float64)
    frequency, phase = _fit_phase(time, position, segment.frequency_hz)
    turns = phase / (2 * np.pi)
    # Counted from the first sample, at whatever phase it is: every turn is then a whole cycle, except the last.
    cycle = np.floor(turns - turns[0] + _ROUNDING).astype(np.int64)
    whole = _WHOLE / float(np.median(np.diff(turns)))
    first = _find_starts(cycle)
    is_whole = np.diff(first, append=len(cycle)) >= whole
    if not is_whole.any():
        return None
    strokes = _find_strokes(position, first)
    full = cycle[first[is_whole & (strokes >= _FULL_STROKE * np.median(strokes[is_whole]))]]
    full = full[1:] if len(full) > 1 else full  # the first begins in the state that the stroke before has left
    number = np.minimum(np.searchsorted(full, cycle), len(full) - 1)
    inside = full[number] == cycle
    if inside.sum() < _MIN_SAMPLES:
        return None
    phase = (turns[inside] + _ROUNDING) % 1.0 * PHASES
    return PhasedRows(segment.first + np.flatnonzero(inside), number[inside], phase, frequency)


def _find_starts(cycle: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the first sample of each cycle; the cycles are numbered in the order of the samples."""
    return np.flatnonzero(np.diff(cycle, prepend=cycle[0] - 1))


def _find_strokes(position: Array, first: npt.NDArray[np.int64]) -> Array:
    """Return half of the stroke of each cycle [m]."""
    return (np.maximum.reduceat(position, first) - np.minimum.reduceat(position, first)) / 2


def _integrate(force: Array, position: Array, cycle: npt.NDArray[np.int64]) -> Array:
    """Return the integral of the force over the displacement in each cycle [J], by the trapezoidal rule."""
    work = (force[1:] + force[:-1]) / 2 * np.diff(position)
    energies: Array = np.bincount(cycle[1:], np.where(np.diff(cycle) == 0, work, 0.0)).astype(np.float64)
    return energies


def _fit_phase(time: Array, position: Array, frequency: float) -> tuple[float, Array]:
    """Return the frequency [Hz] and the phase of each sample [rad], from two sines fitted to both halves."""
    middle = len(time) // 2
    halves = [
        _find_offset(time[part], position[part], frequency) for part in (slice(0, middle), slice(middle, None))
    ]
    drift = np.angle(np.exp(1j * (halves[1] - halves[0])))
    # Between the middles of both halves the phase has drifted by what the frequency is off.
    shift = float(drift / (2 * np.pi * (time[middle:].mean() - time[:middle].mean())))
    corrected = frequency + shift
    return corrected, 2 * np.pi * corrected * time + _find_offset(time, position, corrected) % (2 * np.pi)


def _find_offset(time: Array, position: Array, frequency: float) -> float:
    """Return the phase [rad] at time 0 of the sine that fits the displacement best."""
    angle = 2 * np.pi * frequency * time
    basis = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    # Over whole cycles the columns are nearly orthogonal, so that the normal equations are exact enough, and fast.
    sine, cosine, _ = np.linalg.lstsq(basis.T @ basis, basis.T @ position, rcond=None)[0]
    return float(np.arctan2(cosine, sine))


def _average_given(table: SampleTable, phased: PhasedRows) -> float | None:
    if "temperature" not in table.columns:
        return None
    values = table.columns["temperature"][phased.rows]
    given = values[~np.isnan(values)]
    return float(given.mean(dtype=np.float64)) if len(given) else None
