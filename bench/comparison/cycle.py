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
    phase: npt.NDArray[np.int64]
    """Phase of each sample, 0 to PHASES - 1."""
    frequency: float
    """[Hz]"""

    def average(self, values: Array) -> Array:
        """Return the mean at each phase, shape (PHASES,), of values at the samples."""
        count = np.bincount(self.phase, minlength=PHASES)
        mean = np.bincount(self.phase, values, PHASES) / np.maximum(count, 1)
        return _fill(mean, count > 0)


def average_cycles(table: SampleTable, segment: SegmentRange) -> MeanCycle | None:
    """Return the mean cycle of a segment; None if it is not periodic or has no whole cycle."""
    phased = find_phases(table, segment)
    if phased is None:
        return None
    position, force, speed, drive = (
        table.columns[name][phased.rows].astype(np.float64)
        for name in ("displacement", "force", "velocity", "coil_drive")
    )
    cycles = [np.flatnonzero(phased.cycle == number) for number in range(int(phased.cycle.max()) + 1)]
    peaks = [(force[rows].min(), force[rows].max(), np.abs(speed[rows]).max()) for rows in cycles]
    return MeanCycle(
        displacement=phased.average(position),
        velocity=phased.average(speed),
        force=phased.average(force),
        strokes=np.array([np.ptp(position[rows]) / 2 for rows in cycles]),
        peaks=np.array(peaks).T,
        energies=np.array([float(np.trapezoid(force[rows], position[rows])) for rows in cycles]),
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
    cycle = np.floor(turns - turns[0]).astype(np.int64)
    whole = _WHOLE / float(np.median(np.diff(turns)))
    kept = [number for number in np.unique(cycle) if (cycle == number).sum() >= whole]
    if not kept:
        return None
    strokes = np.array([np.ptp(position[cycle == number]) for number in kept])
    full = [n for n, stroke in zip(kept, strokes, strict=True) if stroke >= _FULL_STROKE * np.median(strokes)]
    full = full[1:] or full  # the first cycle begins in the state that the stroke before has left
    inside = np.isin(cycle, full)
    if inside.sum() < _MIN_SAMPLES:
        return None
    number = np.searchsorted(np.array(full), cycle[inside])
    place = np.minimum((turns[inside] % 1.0 * PHASES).astype(np.int64), PHASES - 1)
    return PhasedRows(segment.first + np.flatnonzero(inside), number, place, frequency)


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
    sine, cosine, _ = np.linalg.lstsq(basis, position, rcond=None)[0]
    return float(np.arctan2(cosine, sine))


def _fill(values: Array, is_given: npt.NDArray[np.bool_]) -> Array:
    """Return values in which empty phases are interpolated around the cycle."""
    places = np.arange(len(values))
    return np.interp(places, places[is_given], values[is_given], period=len(values))


def _average_given(table: SampleTable, phased: PhasedRows) -> float | None:
    if "temperature" not in table.columns:
        return None
    values = table.columns["temperature"][phased.rows]
    given = values[~np.isnan(values)]
    return float(given.mean(dtype=np.float64)) if len(given) else None
