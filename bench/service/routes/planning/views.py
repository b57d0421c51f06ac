"""Requests and responses of planning, with units in the descriptions."""

from datetime import datetime
from typing import Any

from pydantic import Field, PositiveFloat

from bench.agent_protocol import BenchLimit
from bench.methods import DriveKind, Envelope
from bench.service.views import BenchName, View
from bench.validation import SerialNumber


class MethodSummary(View):
    """One version of a method."""

    name: str
    version: int = Field(description="number of the version; 1 is the included one of a method of mrbench")
    sha256: str = Field(description="hash of the content")
    source: str = Field(description="`included` in mrbench, or `stored` by a person")
    created: datetime | None = Field(description="UTC at which this version was stored; null for an included one")
    title: str
    duration_s: float = Field(description="duration with conditioning, fades and moves [s]")
    drive_kind: DriveKind = Field(description="quantity that drives the damper")
    checkpoints: tuple[str, ...] = Field(
        description="segments after which a run can be paused, and resumed (`resume_after`)"
    )
    approved: datetime | None = Field(description="UTC at which this content was approved; null if it is not")
    approved_by: str = Field(description="person who approved it; empty if nobody did")
    usable: bool = Field(description="false if this bench cannot run it")
    obstacle: str = Field(description="reason why this bench cannot run it; empty if it can or no bench answers")


class MethodPage(View):
    """Methods in the order of their names."""

    items: tuple[MethodSummary, ...]
    next: str | None = Field(description="value of `before` for the next page; null on the last page")


class MethodVersions(View):
    """Versions of one method, the newest first."""

    items: tuple[MethodSummary, ...]


class PreviewSeries(View):
    """Planned quantity over time, reduced to the lowest and the highest value of short intervals."""

    time_s: list[float] = Field(description="time from the start of the plan [s]")
    values: list[float] = Field(description="value at each time")


class PreviewSegment(View):
    """Time of a segment in the plan."""

    name: str
    start_s: float = Field(description="[s]")
    end_s: float = Field(description="[s]")
    checkpoint: bool = Field(description="true if an interrupted run can be resumed after this segment")


class MethodPreview(View):
    """Motion and drive of a method as they will be commanded."""

    name: str
    duration_s: float = Field(description="duration with conditioning, fades and moves [s]")
    drive_unit: str = Field(description="V or A")
    displacement_m: PreviewSeries = Field(description="commanded displacement [m]")
    drive: PreviewSeries = Field(description="commanded drive [V or A]")
    segments: tuple[PreviewSegment, ...] = Field(description="in order")


class DryRunRequest(View):
    """Request of a dry run."""

    method: str | dict[str, Any] = Field(description="name of a method, or a document `mrbench.method/1`")
    version: int | None = Field(default=None, ge=1, description="version of a named method; by default the newest")
    identifiability: bool = Field(
        default=True, description="also assess what the strokes can identify, which takes some seconds"
    )
    bench: BenchName | None = Field(default=None, description="name of the bench; needed if there are several")


class BenchCheck(View):
    """Comparison of a method with this bench."""

    limits: dict[str, BenchLimit] = Field(description="limits of the fixture; empty if no bench answers")
    obstacles: tuple[str, ...] = Field(description="reasons why a run would be refused or stopped; empty for none")
    unknown: str = Field(description="reason why the bench is not known; empty if it is")
    log_bytes: int | None = Field(description="largest expected size of the log [byte]; null without a bench")
    free_bytes: int | None = Field(description="free space of the disk [byte]; null if it is not known")


class DryRun(View):
    """Forecast of a run, before anything moves."""

    sha256: str = Field(description="hash of the content of the method")
    envelope: Envelope = Field(description="peaks with the limits of the method, heat, and what is identifiable")
    mean_heat_w: float = Field(description="largest expected mean heat flow into the damper [W]")
    preview: MethodPreview
    checkpoints: tuple[str, ...] = Field(description="segments after which a run can be paused")
    bench: BenchCheck
    identifiability_error: str = Field(description="reason why the identifiability is not known; empty otherwise")


class SpecimenLimits(View):
    """Known limits of a specimen; null for one that is not known."""

    stroke_m: PositiveFloat | None = Field(default=None, description="[m] largest displacement from its middle")
    velocity_mps: PositiveFloat | None = Field(default=None, description="[m/s] largest velocity")
    force_n: PositiveFloat | None = Field(default=None, description="[N] largest force")
    drive: PositiveFloat | None = Field(default=None, description="[V or A] largest drive")
    temperature_c: float | None = Field(default=None, description="[degC] largest temperature")


class SpecimenChange(View):
    """Description of a specimen; what is left out stays as it is."""

    description: str = Field(default="", max_length=2000, description="text for people")
    damper_kind: str = Field(default="", max_length=200, description="kind of the damper, such as its type number")
    drive_kind: DriveKind | None = Field(default=None, description="quantity that drives it; null if not known")
    limits: SpecimenLimits = Field(default=SpecimenLimits(), description="known limits")


class SpecimenRequest(SpecimenChange):
    """Registration of a specimen."""

    serial: SerialNumber = Field(description="serial number")


class SpecimenView(View):
    """One specimen; a serial number that only runs name has no description."""

    serial: str
    description: str
    damper_kind: str = Field(description="kind of the damper, such as its type number")
    drive_kind: str | None = Field(description="quantity that drives it; null if not known")
    limits: SpecimenLimits
    registered: datetime | None = Field(description="UTC of the first description; null without one")
    runs: int = Field(description="number of runs")
    last_run: datetime | None = Field(description="UTC of the start of the newest run; null without one")


class SpecimenPage(View):
    """Specimens in the order of their serial numbers."""

    items: tuple[SpecimenView, ...]
    next: str | None = Field(description="value of `before` for the next page; null on the last page")


class ParameterValue(View):
    """Parameter of a fit."""

    value: float
    unit: str
    ci95: tuple[float, float] | None = Field(description="95 % interval; null where the run does not determine it")
    identifiable: bool


class RunParameters(View):
    """Parameters of the newest fit of one run."""

    run: str
    started: datetime = Field(description="UTC")
    fit: str = Field(description="id of the fit")
    parameters: dict[str, ParameterValue]


class SpecimenParameters(View):
    """Parameters of a specimen over its newest runs with a fit, the oldest first."""

    items: tuple[RunParameters, ...]
