"""Comparison of two or more runs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bench.comparison.conditions import compare_conditions, compare_identity
from bench.comparison.document import (
    Band,
    ComparedRun,
    ComparedStroke,
    Comparison,
    ComparisonRequest,
    Difference,
    Stroke,
)
from bench.comparison.matching import AveragedSegment, average_segments, find_match, make_stroke
from bench.comparison.parameters import compare_parameters
from bench.comparison.series import ForceSeries
from bench.comparison.tolerance import average_uncertainty, judge_drives, make_band
from bench.samples import SampleTable


@dataclass(frozen=True)
class RecordedRun:
    """Run with everything that a comparison reads."""

    facts: ComparedRun
    table: SampleTable
    fit: Mapping[str, Any] | None = None
    """Document of the newest fit; None without one."""
    series: ForceSeries | None = None
    """Series of the newest fit; needed of a reference only."""


@dataclass(frozen=True)
class _MatchedStroke:
    """Segment of the first run, and those of other runs that match it, by run."""

    first: AveragedSegment
    segments: dict[str, AveragedSegment]


def compare_runs(runs: Sequence[RecordedRun], request: ComparisonRequest) -> Comparison:
    """Compare runs with the first one, and with a reference if one is named.

    Args:
        runs: in the order of the request.
        request: reference and tolerance.
    """
    matches = list(_match_strokes(runs))
    strokes = tuple(_compare_stroke(runs, match, request) for match in matches)
    return Comparison(
        runs=tuple(run.facts for run in runs),
        drive_unit=runs[0].table.drive_unit,
        differences=tuple(_list_differences(runs, strokes)),
        strokes=strokes,
        parameters=compare_parameters({run.facts.run: run.fit for run in runs if run.fit is not None}),
        reference=request.reference,
        verdicts=judge_drives(strokes),
        notes=tuple(_list_notes(runs, strokes, request)),
    )


def _match_strokes(runs: Sequence[RecordedRun]) -> Iterator[_MatchedStroke]:
    averaged = {run.facts.run: average_segments(run.table) for run in runs}
    first_id = runs[0].facts.run
    for first in averaged[first_id]:
        found = {run: find_match(first, segments) for run, segments in averaged.items() if run != first_id}
        matched = {run: one for run, one in found.items() if one is not None}
        if matched:
            yield _MatchedStroke(first, {first_id: first, **matched})


def _compare_stroke(
    runs: Sequence[RecordedRun], match: _MatchedStroke, request: ComparisonRequest
) -> ComparedStroke:
    strokes = tuple(make_stroke(run, one) for run, one in match.segments.items())
    return ComparedStroke(
        name=match.first.segment.name,
        drive=match.first.cycle.drive,
        strokes=strokes,
        band=_make_band(runs, match, strokes, request),
    )


def _make_band(
    runs: Sequence[RecordedRun], match: _MatchedStroke, strokes: Sequence[Stroke], request: ComparisonRequest
) -> Band | None:
    reference = next((run for run in runs if run.facts.run == request.reference), None)
    stroke = next((one for one in strokes if one.run == request.reference), None)
    if reference is None or stroke is None:
        return None
    uncertainty = None
    if reference.series is not None:
        segment = match.segments[stroke.run].segment
        uncertainty = average_uncertainty(reference.table, segment, reference.series)
    others = [one for one in strokes if one.run != stroke.run]
    return make_band(stroke, others, uncertainty, request.tolerance_percent)


def _list_differences(runs: Sequence[RecordedRun], strokes: Sequence[ComparedStroke]) -> Iterator[Difference]:
    first = runs[0]
    for other in runs[1:]:
        yield from compare_identity(first.facts, other.facts)
    for stroke in strokes:
        for one in stroke.strokes[1:]:
            yield from compare_conditions(stroke.strokes[0], one, first.table.drive_unit)


def _list_notes(
    runs: Sequence[RecordedRun], strokes: Sequence[ComparedStroke], request: ComparisonRequest
) -> Iterator[str]:
    if not strokes:
        yield "No stroke of the first run has a counterpart in another run; compare runs of the same method."
    matched = {one.run for stroke in strokes for one in stroke.strokes}
    for run in runs[1:]:
        if strokes and run.facts.run not in matched:
            yield f"Run {run.facts.run} has no stroke like those of the first run."
    if any(stroke.band and stroke.band.model_uncertainty_n is None for stroke in strokes):
        yield (
            f"Run {request.reference} has no fit with a force band, so its tolerance band contains the tolerance "
            "alone; request its identification."
        )
