"""Tolerance band of a reference run, and the verdict on other runs.

At each phase the band reaches from the reference's mean force by the tolerance and by the uncertainty of the
reference's model. That uncertainty is the half-width of the 95 % band of its fit: of parameters, misfit and noise.
"""

from collections.abc import Sequence

import numpy as np

from bench.comparison.cycle import PHASES, Array, find_phases
from bench.comparison.document import Band, BandTest, ComparedStroke, DriveVerdict, Stroke
from bench.comparison.series import ForceSeries
from bench.samples import SampleTable, SegmentRange

MIN_INSIDE = 0.95
"""Share of the phases that have to be inside, as the model's band is one of 95 %."""
_DRIVE_STEP = 0.01
"""Step to which drives are rounded to be taken as one [V or A]."""


def make_band(
    reference: Stroke, others: Sequence[Stroke], uncertainty: Array | None, tolerance_percent: float
) -> Band:
    """Return the band of a stroke, with the tests of all other runs.

    Args:
        reference: stroke of the reference run.
        others: the same stroke of other runs.
        uncertainty: half-width of the model's band at each phase [N], shape (PHASES,); None if it is not known.
        tolerance_percent: tolerance in percent of the reference's peak force.
    """
    force = np.array(reference.curve.force_n)
    tolerance = tolerance_percent / 100 * max(reference.peak_tension_n, -reference.peak_compression_n)
    half = tolerance + (np.zeros(PHASES) if uncertainty is None else uncertainty)
    return Band(
        lower_n=(force - half).tolist(),
        upper_n=(force + half).tolist(),
        tolerance_n=tolerance,
        model_uncertainty_n=None if uncertainty is None else float(uncertainty.mean()),
        tests=tuple(_test(other, force, half) for other in others),
    )


def _test(other: Stroke, force: Array, half: Array) -> BandTest:
    margins = half - np.abs(np.array(other.curve.force_n) - force)
    inside = float((margins >= 0).mean())
    margin = float(margins.min())
    return BandTest(
        run=other.run,
        result="pass" if inside >= MIN_INSIDE else "fail",
        inside=inside,
        largest_excess_n=max(0.0, -margin),
        margin_n=margin,
    )


def average_uncertainty(table: SampleTable, segment: SegmentRange, series: ForceSeries) -> Array | None:
    """Return the half-width of the model's band at each phase of a segment [N]; None where it is not known."""
    phased = find_phases(table, segment)
    if phased is None or series.half_width is None:
        return None
    time = table.time[phased.rows]
    if time[0] < series.time[0] or time[-1] > series.time[-1]:
        return None
    return phased.average(np.interp(time, series.time, series.half_width))


def judge_drives(strokes: Sequence[ComparedStroke]) -> tuple[DriveVerdict, ...]:
    """Return the verdict by run and drive: a run passes at a drive if all its strokes there pass."""
    results: dict[tuple[str, float], list[bool]] = {}
    for stroke in strokes:
        for test in stroke.band.tests if stroke.band else ():
            drive = round(round(stroke.drive / _DRIVE_STEP) * _DRIVE_STEP, 6)
            results.setdefault((test.run, drive), []).append(test.result == "pass")
    return tuple(
        DriveVerdict(run=run, drive=drive, result="pass" if all(passed) else "fail", strokes=len(passed))
        for (run, drive), passed in results.items()
    )
