"""Strokes of several runs that belong together, by name or by motion and drive."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.comparison.cycle import PHASES, MeanCycle, average_cycles
from bench.comparison.document import Curve, Stroke
from bench.samples import SampleTable, SegmentRange

_MAX_RATIO = 1.3
"""Ratio of amplitudes or frequencies up to which two strokes of different names belong together."""
_MAX_DRIVE = 0.1
"""Difference of their drives, over the largest drive."""


@dataclass(frozen=True)
class AveragedSegment:
    """Segment of a run with its mean cycle."""

    segment: SegmentRange
    cycle: MeanCycle

    @property
    def amplitude(self) -> float:
        """Half of the stroke [m]."""
        return float(self.cycle.strokes.mean())


def average_segments(table: SampleTable) -> list[AveragedSegment]:
    """Return the periodic segments of a run with a constant drive and at least one whole cycle."""
    periodic = (one for one in table.segments if one.drive_value is not None)
    cycles = ((segment, average_cycles(table, segment)) for segment in periodic)
    return [AveragedSegment(segment, cycle) for segment, cycle in cycles if cycle is not None]


def find_match(wanted: AveragedSegment, others: Sequence[AveragedSegment]) -> AveragedSegment | None:
    """Return the stroke of the same name, else the most similar one; None if none is similar."""
    named = [other for other in others if other.segment.name == wanted.segment.name]
    similar = named or [other for other in others if _is_similar(wanted, other)]
    return min(similar, key=lambda other: _compute_distance(wanted, other), default=None)


def _is_similar(one: AveragedSegment, other: AveragedSegment) -> bool:
    ratios = (one.amplitude / other.amplitude, one.cycle.frequency / other.cycle.frequency)
    largest = max(abs(one.cycle.drive), abs(other.cycle.drive), 1e-9)
    is_same_motion = one.segment.motion == other.segment.motion
    is_near = all(1 / _MAX_RATIO < ratio < _MAX_RATIO for ratio in ratios)
    return is_same_motion and is_near and abs(one.cycle.drive - other.cycle.drive) <= _MAX_DRIVE * largest


def _compute_distance(one: AveragedSegment, other: AveragedSegment) -> float:
    ratios = (one.amplitude / other.amplitude, one.cycle.frequency / other.cycle.frequency)
    return float(np.abs(np.log(ratios)).sum() + abs(one.cycle.drive - other.cycle.drive))


def make_stroke(run: str, one: AveragedSegment) -> Stroke:
    """Return a stroke as a part of the document."""
    cycle = one.cycle
    lowest, highest, speed = cycle.peaks.mean(axis=1)
    return Stroke(
        run=run,
        segment=one.segment.name,
        cycles=len(cycle.energies),
        amplitude_m=one.amplitude,
        frequency_hz=cycle.frequency,
        drive=cycle.drive,
        temperature_c=cycle.temperature,
        preload_n=float(cycle.force.mean()),
        peak_tension_n=float(highest),
        peak_compression_n=float(lowest),
        peak_velocity_mps=float(speed),
        energy_j=float(cycle.energies.mean()),
        energy_sd_j=float(cycle.energies.std(ddof=1)) if len(cycle.energies) > 1 else 0.0,
        curve=Curve(
            phase=[(place + 0.5) / PHASES for place in range(PHASES)],
            displacement_m=cycle.displacement.tolist(),
            velocity_mps=cycle.velocity.tolist(),
            force_n=cycle.force.tolist(),
        ),
    )
