"""The dry run: what a programme will ask of the machine, before anything moves.

Displacement, velocity and acceleration are the programme's own. The force is an estimate for a named damper, by
the modified Bouc-Wen law with the hysteretic element fully yielded and the field settled:

    |force| <= c1/(c0 + c1) (F(drive) + c0 |v|) + |(k1 + k0 c1/(c0 + c1)) x - f0|

It overshoots what a damper gives at rest or just after a step of the drive, and knows nothing of end stops.
"""

from typing import Any, Literal

import numpy as np
from pydantic import Field

from bench.errors import MethodError
from bench.methods.compile import Programme
from bench.methods.document import Limits
from bench.methods.frozen import Frozen
from bench.methods.kinematics import Array
from identification.damper.coordinates import to_coordinates
from identification.damper.law import at_field
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.damper.parameters import Parameters

USUAL_DAMPER = {"V": "laboratory", "A": "lord_class"}
"""The shipped damper whose force is expected where none is named, by drive unit."""


class Peaks(Frozen):
    """The largest magnitudes of a stretch."""

    name: str = Field(description="The segment, or the method for the whole programme.")
    duration_s: float = Field(description="[s] length.")
    displacement_m: float = Field(description="[m] largest displacement from zero.")
    velocity_mps: float = Field(description="[m/s] largest velocity.")
    acceleration_mps2: float = Field(description="[m/s²] largest acceleration.")
    force_n: float = Field(description="[N] largest force expected of the damper.")
    drive: float = Field(description="[V or A] largest drive.")


class Envelope(Frozen):
    """What a method will ask of the machine and of a damper."""

    schema_name: Literal["mrbench.envelope/1"] = Field(
        default="mrbench.envelope/1", alias="schema", description="Name of this form."
    )
    method: str = Field(description="Name of the method.")
    damper: str = Field(description="Parameter set behind the expected force.")
    drive_unit: str = Field(description="Unit of the drive.")
    samples: int = Field(description="[1] samples of the programme.")
    whole: Peaks = Field(description="The programme with everything between its segments.")
    segments: tuple[Peaks, ...] = Field(description="Its segments, in their order.")
    limits: Limits = Field(description="The method's own limits.")
    verdict: Literal["within limits", "force limit exceeded"] = Field(
        description="Whether the expected force stays below its limit; all else was checked in compiling."
    )
    foreseen: dict[str, Any] | None = Field(
        default=None,
        description="What these strokes can tell of a damper, as mrbench.foresight/1; null where unknown.",
    )


def envelope(programme: Programme, damper: str | None = None) -> Envelope:
    """The peaks of a programme, of each segment and in all.

    Args:
        programme: a compiled method.
        damper: name of a shipped parameter set; the usual one of the drive's unit if none is given.

    Raises:
        MethodError: there is no such damper, or it takes another kind of drive.
    """
    unit = programme.method.drive_unit
    name = damper or USUAL_DAMPER[unit]
    force = expected_force(programme, _parameters(name, unit))
    segments = tuple(
        _peaks(programme, force, slice(segment.start, segment.stop), segment.name)
        for segment in programme.segments
    )
    whole = _peaks(programme, force, slice(None), programme.method.name)
    limits = programme.method.limits
    return Envelope(
        method=programme.method.name,
        damper=name,
        drive_unit=unit,
        samples=len(programme.time),
        whole=whole.model_copy(update={"duration_s": programme.duration}),
        segments=segments,
        limits=limits,
        verdict="within limits" if whole.force_n <= limits.force_n else "force limit exceeded",
    )


def expected_force(programme: Programme, parameters: Parameters) -> Array:
    """Largest force [N] that a yielded damper can give at each sample, shape (samples,)."""
    regular = to_coordinates(parameters)
    yielding = at_field(regular.F_a, regular.F_b, programme.drive)
    c0 = at_field(regular.c0_a, regular.c0_b, programme.drive)
    c1 = at_field(regular.c1_a, regular.c1_b, programme.drive)
    share = c1 / (c0 + c1)
    moving = share * (yielding + c0 * np.abs(programme.velocity))
    springs = np.abs((regular.k1 + regular.k0 * share) * programme.displacement - regular.f0)
    return np.asarray(moving + springs, dtype=np.float64)


def envelope_lines(found: Envelope) -> list[str]:
    """The envelope as a table of plain text, for a person."""
    width = max(len(peaks.name) for peaks in (found.whole, *found.segments))
    head = f"{'':{width}}    time  stroke velocity  acceler.   force  drive"
    units = f"{'':{width}}       s      mm      m/s      m/s²       N {found.drive_unit:>6}"
    limits = found.limits
    limit_line = (
        f"{'limits':{width}}        {limits.stroke_m * 1e3:8.1f}{limits.velocity_mps:9.3f}"
        f"{limits.acceleration_mps2:10.2f}{limits.force_n:8.0f}{limits.drive:7.2f}"
    )
    rows = [_row(peaks, width) for peaks in (*found.segments, found.whole)]
    last = f"{found.verdict}; force as expected of the damper {found.damper}, {found.samples} samples"
    return [head, units, *rows, limit_line, last]


def _row(peaks: Peaks, width: int) -> str:
    return (
        f"{peaks.name:{width}}{peaks.duration_s:8.1f}{peaks.displacement_m * 1e3:8.1f}{peaks.velocity_mps:9.3f}"
        f"{peaks.acceleration_mps2:10.2f}{peaks.force_n:8.0f}{peaks.drive:7.2f}"
    )


def _peaks(programme: Programme, force: Array, part: slice, name: str) -> Peaks:
    return Peaks(
        name=name,
        duration_s=len(programme.time[part]) / programme.rate,
        displacement_m=_largest(programme.displacement[part]),
        velocity_mps=_largest(programme.velocity[part]),
        acceleration_mps2=_largest(programme.acceleration[part]),
        force_n=_largest(force[part]),
        drive=_largest(programme.drive[part]),
    )


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values)))


def _parameters(name: str, unit: str) -> Parameters:
    found = PARAMETER_SETS.get(name)
    if found is None:
        raise MethodError(f"no damper {name} to expect a force of; there are {', '.join(sorted(PARAMETER_SETS))}")
    if found.drive_unit != unit:
        raise MethodError(
            f"damper {name} is driven in {found.drive_unit}, the method in {unit}; name one that fits the method"
        )
    return found.parameters
