"""Documents of a diagnosis: mrbench.diagnosis/1, and the twin as mrbench.scenario/1."""

from typing import Any, Literal

from pydantic import AliasChoices, Field

from identification.damper.definitions import Curve, EffectFile
from identification.damper.effects import Place, Stage, Variable
from identification.documents.document import Document
from identification.documents.fit import Fit, ForceError, Nuisances, Provenance
from identification.documents.learned_residual import TwinResidual

DriveKind = Literal["driver_command_v", "coil_v", "coil_a"]
Verdict = Literal["no_gap", "explained", "partly_explained", "unexplained"]


class EffectValue(Document):
    """One parameter of a named effect."""

    value: float = Field(description="estimated value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] = Field(description="95 % interval, in `unit`; it contains the value")


class NamedEffect(Document):
    """An effect of the most probable set."""

    name: str = Field(description="name in the library of effects")
    stage: Stage = Field(description="stage of the signal chain")
    place: Place | None = Field(default=None, description="place in the signal chain; null in older documents")
    variable: Variable | None = Field(
        default=None, description="variable on which it depends most; null in older documents"
    )
    form: str = Field(description="fitted functional form")
    parameters: dict[str, EffectValue] = Field(description="parameters by their names in the library")
    share: float = Field(
        description="part of the gap's variance that returns without this effect: (error² without it - "
        "`after_n`²) / (`before_n`² - `noise_floor_n`²), on held-out strokes"
    )
    share_ci95: tuple[float, float] | None = Field(
        default=None, description="95 % interval of the share, from resampled held-out cycles"
    )
    probability: float = Field(ge=0, le=1, description="probability that this effect is active")
    note: str = Field(default="", description="limits of the values, such as the sense of an asymmetry")


class EffectSet(Document):
    """Another set of effects that these data cannot separate from the named one."""

    effects: list[str] = Field(description="names of the effects; empty for none")
    probability: float = Field(ge=0, le=1, description="probability of exactly this set")


class HeldOutError(Document):
    """Error on the strokes that the user held out; no fit and no choice has read them."""

    rmse_n: float = Field(description="RMSE with the named effects, in N; y(0) is estimated for unread stretches")
    nrmse: float = Field(description="the same over the standard deviation of the recorded force")
    with_residual: ForceError | None = Field(
        default=None, description="the same with the learned residual of the twin; null without `--residual`"
    )

    def to_force_error(self) -> ForceError:
        """Return the error without that of the learned residual."""
        return ForceError(rmse_n=self.rmse_n, nrmse=self.nrmse)


class Gap(Document):
    """Difference between simulated and recorded force on held-out strokes."""

    before_n: float = Field(description="RMSE of the refitted law without effects, in N")
    after_n: float = Field(
        description="RMSE with the named effects that is expected of another run, in N: remaining error beyond "
        "the floor, and input noise of that run; equal to `before_n` if no effect is named"
    )
    explainable_n: float | None = Field(
        default=None,
        description="lowest RMSE that any model of stroke, drive and time reached, in N: a fitted set of effects, "
        "or a flexible regression on its residual",
    )
    noise_floor_n: float = Field(description="noise of the recorded force, in N, the same for both")
    noise_floor_ci95: tuple[float, float] | None = Field(
        default=None,
        description="95 % interval of that noise, in N; where no cycles show it, its lower bound and `after_n`",
    )
    floor_known: bool = Field(
        default=True, description="false where no cycles show it, so that it is only bounded"
    )
    shrinkage: float | None = Field(
        description="1 - (after² - floor²)/(before² - floor²); null where before is within 2 % of the floor"
    )
    shrinkage_ci95: tuple[float, float] | None = Field(
        description="95 % interval for other runs: resampled conditions and cycles, input noise, form error and "
        "its growth on other strokes"
    )
    nominal_n: float | None = Field(default=None, description="RMSE of the given simulation, in N; null if none")
    held_out: HeldOutError | None = Field(
        default=None, description="error on the strokes of `--hold-out` or `--hold-out-after`; null without either"
    )
    train_before_n: float = Field(description="RMSE without effects on the fitted strokes, in N")
    train_after_n: float = Field(description="RMSE with the named effects on the fitted strokes, in N")


class GapMapEntry(Document):
    """Residual of the refitted law beyond the noise floor, in one condition."""

    drive: float = Field(description="drive in V or A")
    amplitude_m: float = Field(description="amplitude in m")
    frequency_hz: float = Field(description="frequency in Hz; 0 where the motion is not periodic")
    phase: float = Field(
        description="phase of the stroke in cycles: 0 at the middle in extension, 0.25 at the extended end"
    )
    gap_n: float = Field(description="root mean square residual beyond the noise floor, in N")


class ResidualHarmonic(Document):
    """One harmonic of the stroke in the residual."""

    order: int = Field(description="multiple of the stroke's frequency")
    rms_n: float = Field(description="root mean square over all periodic strokes, in N")


class Drift(Document):
    """Change of the residual over time."""

    slope_n_per_s: float = Field(description="slope of its mean, in N/s")
    mean_rms_n: float = Field(description="standard deviation of its mean from segment to segment, in N")
    size_change: float = Field(description="relative change of the force's size over the recording")
    line_hz: float | None = Field(
        description="frequency of a spectral line that is not locked to the stroke, in Hz; null if none"
    )
    line_n: float = Field(description="amplitude of that line, in N")


class GapLocation(Document):
    """Conditions in which the gap appears, and the stage that it points to."""

    stage: Stage | None = Field(description="most probable stage; null where there is no gap")
    stages: dict[Stage, float] = Field(description="probability of a missing effect, by stage")
    map: list[GapMapEntry] = Field(description="by drive, amplitude, frequency and phase of the stroke")
    harmonics: list[ResidualHarmonic] = Field(description="harmonics in the residual of the refitted law")
    drift: Drift
    explainable: float = Field(
        description="part of the gap's variance that a flexible model of motion, drive and time predicts on "
        "held-out cycles"
    )


class Remainder(Document):
    """Part of the gap that the named effects leave, on held-out strokes."""

    gap_n: float = Field(description="root mean square residual beyond the noise floor, in N")
    explainable: float = Field(
        description="part of its variance that a flexible regression on stroke, drive and time predicts"
    )
    not_repeating: float | None = Field(
        description="part of its variance that differs between cycles of a segment; null where no cycles repeat"
    )
    stage: Stage | None = Field(
        description="stage of the curve, or else the known effect, that describes most of it; null where none does"
    )
    map: list[GapMapEntry] = Field(description="by drive, amplitude, frequency and phase of the stroke")
    variables: list[Variable] = Field(description="variables that the regression needs, the strongest first")


class Formula(Document):
    """Formula of a discovered effect."""

    expression: str = Field(description="expression over the variables and symbols")
    symbols: dict[str, EffectValue] = Field(description="parameters of the expression by their names")


class DiscoveredCurve(Document):
    """An effect outside the library: where it acts, on which variables, and its curve."""

    stage: Stage = Field(description="stage of the signal chain")
    place: Place = Field(description="place in the signal chain")
    variables: list[Variable] = Field(description="variable of the curve, then those of its factors")
    curve: Curve = Field(
        description="curve over the first variable with its 95 % band, without the factors; over `time`, where "
        "that is not among the variables, the step response: the part [1] of a change that has arrived by then"
    )
    rmse_n: float = Field(description="RMSE on held-out strokes with this effect and those before it, in N")
    log_odds: float = Field(description="logarithm of the odds (natural) of this effect over the set without it")


class Discovery(DiscoveredCurve):
    """Result of a search for a cause outside the library."""

    replaces: list[str] = Field(
        default_factory=list, description="named effects that are not needed with the discovered one"
    )
    formula: Formula | None = Field(description="shortest formula that does as well; null if none does")
    definition: EffectFile = Field(description="the effect as an effect file")
    shrinkage: float | None = Field(description="as in `gap`, with the discovered effect")
    shrinkage_ci95: tuple[float, float] | None = Field(description="its 95 % interval")
    further: list[DiscoveredCurve] = Field(
        default_factory=list, description="effects found after it in the remaining residual, in this order"
    )


class NextStroke(Document):
    """The stroke that best separates the sets that these data cannot."""

    segment: dict[str, Any] = Field(description="segment of a method document")
    separates: list[list[str]] = Field(description="sets of effects that it separates")
    expected_n: float = Field(description="root mean square difference of their forces, in N")
    detectability: float = Field(
        description="part of that difference that no refit removes, over noise and form error, times the root of "
        "the number of samples"
    )


class CrossCheck(Document):
    """Estimate by a network that has the named effects as terms of its residual and simulates nothing."""

    consistent: bool | None = Field(
        validation_alias=AliasChoices("consistent", "agrees"),
        description="whether all common estimates agree within their intervals; null where the network gave none",
    )
    effects: dict[str, dict[str, EffectValue]] = Field(description="its parameters, by effect and name")
    seconds: float = Field(description="processor time of its training, in s")
    message: str = Field(
        validation_alias=AliasChoices("message", "said"), description="the result as text for a person"
    )


class Diagnosis(Document):
    """Result of a diagnosis of the sim-to-real gap."""

    schema_: Literal["mrbench.diagnosis/1"] = Field(default="mrbench.diagnosis/1", alias="schema")
    verdict: Verdict = Field(
        description="no_gap: nothing beyond the noise floor; explained, partly_explained: the named effects close "
        "the gap, or a part of it; unexplained: no effect is named"
    )
    effects: list[NamedEffect] = Field(description="most probable set; empty for no_gap and unexplained")
    alternatives: list[EffectSet] = Field(max_length=3, description="other sets, the most probable first")
    probability: float = Field(ge=0, le=1, description="probability of exactly the named set")
    ambiguous: bool = Field(
        default=False, description="whether an alternative has more than half of the named set's probability"
    )
    unknown_probability: float = Field(ge=0, le=1, description="probability of a cause outside the library")
    gap: Gap
    where: GapLocation
    remainder: Remainder | None = Field(
        default=None, description="residual with the named effects; null where it is at the noise floor"
    )
    discovery: Discovery | None = Field(
        default=None, description="cause outside the library; null unless searched for and found"
    )
    next_stroke: NextStroke | None = Field(description="null where no sets of effects have to be separated")
    explanation: str = Field(description="two sentences for a person")
    cross_check: CrossCheck | None = Field(
        default=None,
        validation_alias=AliasChoices("cross_check", "witness"),
        description="null unless requested and effects are named",
    )
    notes: list[str] = Field(
        default_factory=list, description="excluded samples, and limitations of the recording"
    )
    provenance: Provenance


class TwinEffect(Document):
    """An effect in a scenario."""

    name: str = Field(description="name in the library of effects")
    form: str = Field(description="functional form")
    parameters: dict[str, float] = Field(description="values in SI units")
    definition: EffectFile | None = Field(
        default=None, description="definition of an effect outside the library; null for one of the library"
    )


class Twin(Document):
    """A scenario made from a fit and the effects of a diagnosis."""

    schema_: Literal["mrbench.scenario/1"] = Field(default="mrbench.scenario/1", alias="schema")
    description: str = Field(default="", description="one line for a person")
    damper: dict[str, float] = Field(description="the fourteen parameters of the paper, in SI units")
    drive_kind: DriveKind = Field(description="quantity that commands the damper")
    drive_unit: Literal["V", "A"] = Field(description="unit of the drive")
    effects: list[TwinEffect] = Field(description="effects that were found")
    sensors: dict[str, dict[str, Any]] = Field(description="estimated noise of the channels")
    nuisances: Nuisances = Field(description="quantities estimated together with the damper: delays, y(0)")
    baseline: Fit = Field(description="the fit without effects")
    residual: TwinResidual | None = Field(
        default=None, description="learned residual, which only predictions use; null without `--residual`"
    )
    provenance: Provenance
