"""Comparison as a document: curves over the phase, conditions, parameters, tolerance band; SI units."""

from datetime import datetime
from typing import Literal, TypeAlias

from pydantic import Field

from bench.validation import FrozenModel

MAX_RUNS = 20
Quantity: TypeAlias = Literal["specimen", "method", "temperature", "stroke", "rate", "drive", "preload"]
Verdict: TypeAlias = Literal["pass", "fail"]


class ComparisonRequest(FrozenModel):
    """Request of a comparison."""

    runs: tuple[str, ...] = Field(
        min_length=2, max_length=MAX_RUNS, description="ids of the runs; all others are compared with the first"
    )
    reference: str | None = Field(
        default=None, description="id of the run with the tolerance band; null for no band"
    )
    tolerance_percent: float = Field(
        default=10.0, gt=0, le=100, description="tolerance in percent of the reference's peak force at each drive"
    )


class ComparedRun(FrozenModel):
    """One run of a comparison."""

    run: str = Field(description="id of the run")
    specimen: str
    method: str
    started: datetime = Field(description="UTC")
    fit: str | None = Field(description="id of the newest fit; null without one")


class Difference(FrozenModel):
    """Condition in which a run differs from the first one."""

    quantity: Quantity
    run: str = Field(description="id of the run that differs")
    segment: str = Field(description="segment of the first run; empty for a difference of whole runs")
    first: float | None = Field(description="value of the first run, in `unit`; null for a text")
    other: float | None = Field(description="value of the other run, in `unit`; null for a text")
    unit: str
    text: str = Field(description="difference for a person, value against value with unit")


class Curve(FrozenModel):
    """Mean cycle over the phase; the phase is 0 where the rod passes the middle outwards."""

    phase: list[float] = Field(description="phase in cycles, 0 to 1")
    displacement_m: list[float]
    velocity_mps: list[float]
    force_n: list[float]


class Stroke(FrozenModel):
    """One segment of one run, averaged over its whole cycles."""

    run: str = Field(description="id of the run")
    segment: str = Field(description="name of the segment in this run")
    cycles: int = Field(description="number of averaged cycles")
    amplitude_m: float = Field(description="half of the stroke [m]")
    frequency_hz: float = Field(description="[Hz]")
    drive: float = Field(description="mean drive [V or A]")
    temperature_c: float | None = Field(description="mean temperature [°C]; null if it was not measured")
    preload_n: float = Field(description="mean force over the cycle [N]")
    peak_tension_n: float = Field(description="largest force, mean over the cycles [N]")
    peak_compression_n: float = Field(description="smallest force, mean over the cycles [N]")
    peak_velocity_mps: float = Field(description="largest speed, mean over the cycles [m/s]")
    energy_j: float = Field(description="dissipated energy per cycle [J]")
    energy_sd_j: float = Field(description="standard deviation of the energy from cycle to cycle [J]")
    curve: Curve


class BandTest(FrozenModel):
    """Test of one stroke of one run against the band of the reference."""

    run: str = Field(description="id of the run")
    result: Verdict
    inside: float = Field(description="share of the phases inside the band, 0 to 1")
    largest_excess_n: float = Field(description="largest distance outside the band [N]; 0 inside")
    margin_n: float = Field(description="smallest distance to the edge of the band [N]; negative outside")


class Band(FrozenModel):
    """Tolerance band of the reference over the phase: tolerance and uncertainty of its model on both sides."""

    lower_n: list[float] = Field(description="[N] at each phase of the curve")
    upper_n: list[float] = Field(description="[N] at each phase of the curve")
    tolerance_n: float = Field(description="tolerance [N]")
    model_uncertainty_n: float | None = Field(
        description="mean half-width of the model's 95 % band [N]; null without a fit of the reference"
    )
    tests: tuple[BandTest, ...]


class ComparedStroke(FrozenModel):
    """One stroke of the first run, with the strokes of the others that match it."""

    name: str = Field(description="name of the segment in the first run")
    drive: float = Field(description="drive of the first run [V or A]")
    strokes: tuple[Stroke, ...] = Field(description="the first run first")
    band: Band | None = Field(description="null without a reference, or where it has no such stroke")


class ParameterDifference(FrozenModel):
    """One identified parameter of all runs with a fit."""

    name: str
    unit: str
    values: dict[str, float] = Field(description="value by id of the run, in `unit`")
    ci95: dict[str, tuple[float, float]] = Field(description="95 % interval by id of the run, in `unit`")
    differs: bool = Field(description="whether two runs have values outside the intervals of each other")


class DriveVerdict(FrozenModel):
    """Verdict on a run at one drive."""

    run: str = Field(description="id of the run")
    drive: float = Field(description="drive of the reference [V or A]")
    result: Verdict = Field(description="pass if every stroke at this drive passes")
    strokes: int = Field(description="number of strokes tested")


class Comparison(FrozenModel):
    """Comparison of two or more runs."""

    runs: tuple[ComparedRun, ...] = Field(description="in the order of the request")
    drive_unit: str = Field(description="V or A")
    differences: tuple[Difference, ...] = Field(description="conditions that differ from the first run")
    strokes: tuple[ComparedStroke, ...] = Field(description="strokes that at least two runs have")
    parameters: tuple[ParameterDifference, ...] = Field(
        description="identified parameters that at least two runs have"
    )
    reference: str | None = Field(description="id of the run with the tolerance band")
    verdicts: tuple[DriveVerdict, ...] = Field(description="by run and drive; empty without a reference")
    notes: tuple[str, ...] = Field(description="limits of this comparison, for a person")
