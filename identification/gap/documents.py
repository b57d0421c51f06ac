"""What the diagnosis answers, as documents: the diagnosis itself and the twin made from it."""

from typing import Any, Literal

from pydantic import Field

from identification.results import Document, Fit, Nuisances, Provenance

DriveKind = Literal["driver_command_v", "coil_v", "coil_a"]
Verdict = Literal["no_gap", "explained", "partly_explained", "unexplained"]
StageName = Literal["coil", "damper", "mounting", "force_channel", "displacement_channel"]
STAGES: tuple[StageName, ...] = ("coil", "damper", "mounting", "force_channel", "displacement_channel")
"""The chain in its order: what every diagnosis gives a probability."""


class EffectValue(Document):
    """One parameter of a named effect."""

    value: float = Field(description="best value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] = Field(description="95 % interval, in `unit`; it holds the value")


class NamedEffect(Document):
    """An effect that is held to be at work."""

    name: str = Field(description="in the library of effects")
    stage: StageName = Field(description="its place in the chain")
    form: str = Field(description="functional form that was fitted")
    parameters: dict[str, EffectValue] = Field(description="by the library's names")
    share: float = Field(description="part of the explained excess variance that is lost without this effect")
    probability: float = Field(ge=0, le=1, description="that this effect is at work at all")
    note: str = Field(default="", description="what a person should know, such as the sense of an asymmetry")


class EffectSet(Document):
    """Another set of effects that these data cannot tell from the named one."""

    effects: list[str] = Field(description="names; empty for none at all")
    probability: float = Field(ge=0, le=1, description="of exactly this set")


class Gap(Document):
    """How far simulation and recording are apart, on strokes kept out of every fit."""

    before_n: float = Field(description="RMSE of the refitted law without effects, in N")
    after_n: float = Field(
        description="RMSE with the named effects in N, to be expected of another run: what the strokes leave "
        "beyond the floor, and noise of that run's motion; `before_n` where none is named"
    )
    noise_floor_n: float = Field(description="noise of the recorded force in N, one figure for both")
    shrinkage: float | None = Field(
        description="1 - (after² - floor²)/(before² - floor²); null where before is within 2 % of the floor"
    )
    shrinkage_ci95: tuple[float, float] | None = Field(
        description="95 % interval for other runs: conditions and cycles drawn anew, "
        "noise of the motion and error of the form allowed for"
    )
    nominal_n: float | None = Field(default=None, description="RMSE of the given simulation in N; null without")
    train_before_n: float = Field(description="RMSE without effects on the fitted strokes, in N")
    train_after_n: float = Field(description="RMSE with the named effects on the fitted strokes, in N")


class Place(Document):
    """The gap in one condition: the part of the residual of the refitted law beyond the noise."""

    drive: float = Field(description="V or A")
    amplitude_m: float = Field(description="in m")
    frequency_hz: float = Field(description="in Hz; 0 where the motion is not periodic")
    phase: float = Field(description="of the stroke in cycles, 0 at the middle in extension, 0.25 extended end")
    gap_n: float = Field(description="root mean square residual beyond the noise, in N")


class Line(Document):
    """One harmonic of the stroke in the residual."""

    order: int = Field(description="multiple of the stroke's frequency")
    rms_n: float = Field(description="root mean square over all periodic strokes, in N")


class Drift(Document):
    """How the residual goes over time."""

    slope_n_per_s: float = Field(description="of its mean, in N/s")
    mean_rms_n: float = Field(description="deviation of its mean from segment to segment, in N")
    size_change: float = Field(description="relative change of the force's size over the recording")
    line_hz: float | None = Field(description="frequency of a line not locked to the stroke, in Hz; null if none")
    line_n: float = Field(description="amplitude of that line in N")


class Where(Document):
    """Where the gap shows, and which stage carries its signature."""

    stage: StageName | None = Field(description="the likeliest; null where there is no gap")
    stages: dict[StageName, float] = Field(description="probability that something is missing at each stage")
    map: list[Place] = Field(description="by drive, amplitude, frequency and phase of the stroke")
    harmonics: list[Line] = Field(description="of the stroke, in the residual of the refitted law")
    drift: Drift
    explainable: float = Field(
        description="part of the gap's variance that a flexible model of motion, drive and time predicts held out"
    )


class NextStroke(Document):
    """The stroke that would best separate what these data leave open."""

    segment: dict[str, Any] = Field(description="as in a method document")
    separates: list[list[str]] = Field(description="the sets of effects it tells apart")
    expected_n: float = Field(description="root mean square difference of their forces there, in N")
    detectability: float = Field(
        description="what no refit takes away of it, over noise and error of forms, times the root of its samples"
    )


class Witness(Document):
    """What the network says that has the named effects as terms of its residual and simulates nothing."""

    agrees: bool | None = Field(
        description="whether everything that both know lies within the intervals; null where it was not heard"
    )
    effects: dict[str, dict[str, EffectValue]] = Field(description="its own parameters, by effect and name")
    seconds: float = Field(description="processor time of its training, in s")
    said: str = Field(description="in a sentence for a person")


class Diagnosis(Document):
    """The answer on the sim-to-real gap."""

    schema_: Literal["mrbench.diagnosis/1"] = Field(default="mrbench.diagnosis/1", alias="schema")
    verdict: Verdict
    effects: list[NamedEffect] = Field(description="empty for no_gap and unexplained")
    alternatives: list[EffectSet] = Field(max_length=3, description="other sets, the likeliest first")
    probability: float = Field(ge=0, le=1, description="of exactly the named set")
    unknown_probability: float = Field(ge=0, le=1, description="that something outside the library is at work")
    gap: Gap
    where: Where
    next_stroke: NextStroke | None = Field(description="null when nothing is open")
    explanation: str = Field(description="two sentences for a person")
    witness: Witness | None = Field(default=None, description="null unless it was asked for and effects are named")
    notes: list[str] = Field(default=[], description="what the recording cannot show, in words")
    provenance: Provenance


class TwinEffect(Document):
    """An effect as a scenario names it."""

    name: str = Field(description="in the library of effects")
    form: str = Field(description="functional form")
    parameters: dict[str, float] = Field(description="values in SI units")


class Twin(Document):
    """A scenario made from a fit and the effects that a diagnosis has added."""

    schema_: Literal["mrbench.scenario/1"] = Field(default="mrbench.scenario/1", alias="schema")
    description: str = Field(default="", description="one line for a person")
    damper: dict[str, float] = Field(description="the paper's fourteen parameters, SI")
    drive_kind: DriveKind = Field(description="what commands the damper")
    drive_unit: Literal["V", "A"] = Field(description="unit of the drive")
    effects: list[TwinEffect] = Field(description="what was found beside the law")
    sensors: dict[str, dict[str, Any]] = Field(description="channels as found: their noise")
    nuisances: Nuisances = Field(description="what had to be estimated along with it: lags of the channels, y(0)")
    baseline: Fit = Field(description="the fit without effects")
    provenance: Provenance
