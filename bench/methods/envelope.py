"""Dry run: peaks of a programme and expected force of a damper.

Displacement, velocity, acceleration and drive are those of the programme. The force is an upper bound for a named
damper by the modified Bouc-Wen law, with the hysteretic element fully yielded and the field settled:

    |force| <= c1/(c0 + c1) (F(drive) + c0 |v|) + |(k1 + k0 c1/(c0 + c1)) x - f0|

It exceeds the force of a damper at rest or just after a step of the drive, and does not include end stops.
"""

from typing import Any, Literal

import numpy as np
from pydantic import Field

from bench.errors import MethodError
from bench.methods.compile import Programme
from bench.methods.document import MethodLimits
from bench.methods.kinematics import Array
from bench.validation import FrozenModel
from identification.damper import PARAMETER_SETS, Parameters, evaluate_coefficient, to_coordinates

DEFAULT_DAMPER = {"V": "laboratory", "A": "lord_class"}
"""Shipped damper whose force is computed if none is named, by drive unit."""


class Peaks(FrozenModel):
    """Largest magnitudes of a segment or of the programme."""

    name: str = Field(description="Name of the segment, or of the method for the programme.")
    duration_s: float = Field(description="[s] duration.")
    displacement_m: float = Field(description="[m] largest displacement from zero.")
    velocity_mps: float = Field(description="[m/s] largest velocity.")
    acceleration_mps2: float = Field(description="[m/s²] largest acceleration.")
    force_n: float = Field(description="[N] largest expected force of the damper.")
    drive: float = Field(description="[V or A] largest drive.")


class Envelope(FrozenModel):
    """Peaks of a method and of its segments."""

    schema_name: Literal["mrbench.envelope/1"] = Field(
        default="mrbench.envelope/1", alias="schema", description="Name and version of this document type."
    )
    method: str = Field(description="Name of the method.")
    damper: str = Field(description="Parameter set for the expected force.")
    drive_unit: str = Field(description="Unit of the drive.")
    samples: int = Field(description="[1] number of samples of the programme.")
    total: Peaks = Field(description="Peaks of the programme, including everything between its segments.")
    segments: tuple[Peaks, ...] = Field(description="Peaks of the segments, in order.")
    heat_j: float = Field(default=0.0, description="[J] largest expected energy that the damper turns into heat.")
    limits: MethodLimits = Field(description="Limits of the method.")
    verdict: Literal["within limits", "force limit exceeded"] = Field(
        description="Whether the expected force stays below its limit; the other limits were checked before."
    )
    design: dict[str, Any] | None = Field(
        default=None,
        description="Precision at which these strokes determine a damper (mrbench.foresight/1); null if unknown.",
    )


def compute_envelope(programme: Programme, damper: str | None = None) -> Envelope:
    """Compute the peaks of a programme and of each segment.

    Args:
        programme: compiled method.
        damper: name of a shipped parameter set; by default `DEFAULT_DAMPER` for the drive unit.

    Raises:
        MethodError: there is no such damper, or its drive has another unit.
    """
    unit = programme.method.drive_unit
    name = damper or DEFAULT_DAMPER[unit]
    parameters = _find_parameters(name, unit)
    force = compute_expected_force(programme, parameters)
    segments = tuple(
        _find_peaks(programme, force, slice(segment.start, segment.stop), segment.name)
        for segment in programme.segments
    )
    total = _find_peaks(programme, force, slice(None), programme.method.name)
    limits = programme.method.limits
    return Envelope(
        method=programme.method.name,
        damper=name,
        drive_unit=unit,
        samples=len(programme.time),
        total=total.model_copy(update={"duration_s": programme.duration}),
        segments=segments,
        heat_j=_compute_heat(programme, parameters),
        limits=limits,
        verdict="within limits" if total.force_n <= limits.force_n else "force limit exceeded",
    )


def compute_expected_force(programme: Programme, parameters: Parameters) -> Array:
    """Compute the upper bound on the force [N] of a yielded damper at each sample, shape (samples,)."""
    regular = to_coordinates(parameters)
    dissipative, share = _compute_dissipative_force(programme, parameters)
    springs = np.abs((regular.k1 + regular.k0 * share) * programme.displacement - regular.f0)
    return np.asarray(dissipative + springs, dtype=np.float64)


def _compute_dissipative_force(programme: Programme, parameters: Parameters) -> tuple[Array, Array]:
    """Return yield and viscous force [N] at each sample, and the share c1 / (c0 + c1)."""
    regular = to_coordinates(parameters)
    yield_force = evaluate_coefficient(regular.F_a, regular.F_b, programme.drive)
    c0 = evaluate_coefficient(regular.c0_a, regular.c0_b, programme.drive)
    c1 = evaluate_coefficient(regular.c1_a, regular.c1_b, programme.drive)
    share = c1 / (c0 + c1)
    return share * (yield_force + c0 * np.abs(programme.velocity)), share


def _compute_heat(programme: Programme, parameters: Parameters) -> float:
    """Return the largest energy [J] that the damper dissipates."""
    force, _ = _compute_dissipative_force(programme, parameters)
    return float(np.sum(force * np.abs(programme.velocity)) / programme.rate)


def compute_heat(programme: Programme, damper: str | None = None) -> float:
    """Compute the heat [J] that a damper dissipates at most during a programme.

    Args:
        programme: compiled method.
        damper: name of a shipped parameter set; by default `DEFAULT_DAMPER` for the drive unit.

    Raises:
        MethodError: there is no such damper, or its drive has another unit.
    """
    unit = programme.method.drive_unit
    force = compute_expected_force(programme, _find_parameters(damper or DEFAULT_DAMPER[unit], unit))
    return float(np.sum(force * np.abs(programme.velocity)) / programme.rate)


def format_envelope(envelope: Envelope) -> list[str]:
    """Format the envelope as a table of plain text."""
    width = max(len(peaks.name) for peaks in (envelope.total, *envelope.segments))
    head = f"{'':{width}}    time  stroke velocity  acceler.   force  drive"
    units = f"{'':{width}}       s      mm      m/s      m/s²       N {envelope.drive_unit:>6}"
    limits = envelope.limits
    limit_line = (
        f"{'limits':{width}}        {limits.stroke_m * 1e3:8.1f}{limits.velocity_mps:9.3f}"
        f"{limits.acceleration_mps2:10.2f}{limits.force_n:8.0f}{limits.drive:7.2f}"
    )
    rows = [_format_row(peaks, width) for peaks in (*envelope.segments, envelope.total)]
    last = f"{envelope.verdict}; expected force of the damper {envelope.damper}, {envelope.samples} samples"
    return [head, units, *rows, limit_line, last]


def _format_row(peaks: Peaks, width: int) -> str:
    return (
        f"{peaks.name:{width}}{peaks.duration_s:8.1f}{peaks.displacement_m * 1e3:8.1f}{peaks.velocity_mps:9.3f}"
        f"{peaks.acceleration_mps2:10.2f}{peaks.force_n:8.0f}{peaks.drive:7.2f}"
    )


def _find_peaks(programme: Programme, force: Array, part: slice, name: str) -> Peaks:
    return Peaks(
        name=name,
        duration_s=len(programme.time[part]) / programme.rate,
        displacement_m=_find_largest(programme.displacement[part]),
        velocity_mps=_find_largest(programme.velocity[part]),
        acceleration_mps2=_find_largest(programme.acceleration[part]),
        force_n=_find_largest(force[part]),
        drive=_find_largest(programme.drive[part]),
    )


def _find_largest(values: Array) -> float:
    return float(np.max(np.abs(values)))


def _find_parameters(name: str, unit: str) -> Parameters:
    parameter_set = PARAMETER_SETS.get(name)
    if parameter_set is None:
        raise MethodError(f"there is no damper {name}; the dampers are {', '.join(sorted(PARAMETER_SETS))}")
    if parameter_set.drive_unit != unit:
        raise MethodError(
            f"the drive of damper {name} is in {parameter_set.drive_unit}, that of the method in {unit}; "
            "name a damper with the unit of the method"
        )
    return parameter_set.parameters
