"""What the identification answers, as documents: frozen, to and from JSON.

Keys carry the unit where no description can (``rmse_n`` is in newton); every other number stands beside its
unit. The JSON Schemas in docs/reference/schemas are generated from these types.
"""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from identification.damper.coordinates import Coordinates
from identification.errors import IdentificationError

FIT_SCHEMA = "mrbench.fit/1"


class Document(BaseModel):
    """Base of all documents: frozen, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


class Estimate(Document):
    """One number with its unit and how well it is known."""

    value: float = Field(description="best value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] | None = Field(description="95 % interval, in `unit`; null where nothing bounds it")
    ci99: tuple[float, float] | None = Field(default=None, description="99 % interval, in `unit`")
    profile95: tuple[float, float] | None = Field(
        default=None, description="95 % interval by profile likelihood, in `unit`, where it was asked for"
    )
    identifiable: bool = Field(description="whether these strokes fix it to better than half its size")
    note: str = Field(default="", description="what a person should know about it")


class Delay(Document):
    """A lag between two channels, beyond what the instruments report."""

    value: float = Field(description="lag in s")
    unit: Literal["s"] = "s"
    ci95: tuple[float, float] | None = Field(description="95 % interval in s")
    prior_sd: float = Field(description="standard deviation allowed beforehand, in s")
    outside_prior: bool = Field(description="three deviations or more away: more than a clock's error")
    note: str = Field(default="", description="what a person should know about it")


class Nuisances(Document):
    """What had to be estimated along with the damper."""

    y0: dict[str, float] = Field(description="inner displacement at the start of each stretch, in m")
    force_delay: Delay = Field(description="lag of the force channel behind the displacement channel")
    drive_delay: Delay = Field(description="further lag of the force channel behind the drive channel")
    each_log: dict[str, dict[str, Estimate]] = Field(
        default_factory=dict, description="what each log behind the first has of its own, where that was asked for"
    )


class NoiseFloor(Document):
    """Noise of the recorded force, in newton, and how it was got."""

    cycle_to_cycle: float | None = Field(description="from repeated cycles, in N; null where none repeat")
    high_frequency: float = Field(description="from fourth differences, in N")
    how: str = Field(description="which was used, and why")


class Errors(Document):
    """One measure of the force error on the samples fitted, on the validation part and on those held out."""

    train: float = Field(description="on the samples that were fitted")
    validation: float | None = Field(description="null where no part is set aside to choose settings by")
    held_out: float | None = Field(description="null where nothing was held out")


class DriveError(Document):
    """Force error at one drive, or in one bin of a varying drive."""

    drive: float = Field(description="drive, or middle of the bin, in `unit`")
    unit: str = Field(description="V or A")
    rmse_n: float = Field(description="root mean square force error in N")
    nrmse: float = Field(description="that, over the standard deviation of the force in these samples")
    samples: int = Field(description="how many samples")


class Stage(Document):
    """One stage of the fit."""

    name: str = Field(description="pinn or refine")
    seconds: float = Field(description="processor time in s")
    rmse_n: float = Field(description="error of the simulated force on the fitted samples after it, in N")
    iterations: int = Field(description="steps of the last descent")
    note: str = Field(default="", description="what a person should know about it")
    simulated_n: Errors | None = Field(
        default=None,
        description="pinn: error in N of the law simulated with the parameters found; the honest figure",
    )
    reconstructed_n: Errors | None = Field(
        default=None, description="pinn: error in N of the network's own force; says little of the parameters"
    )
    coordinates: dict[str, Estimate] | None = Field(
        default=None, description="what this stage found, where the fit as a whole rests on another"
    )


class Provenance(Document):
    """What a document was made from."""

    logs: dict[str, str] = Field(description="file name -> SHA-256 of its content")
    version: str = Field(description="of mrbench")
    seed: int = Field(description="of everything that chance decided")
    settings: dict[str, str | float | int | bool | None] = Field(description="what was asked for")


class Fit(Document):
    """The identified damper."""

    schema_: Literal["mrbench.fit/1"] = Field(default="mrbench.fit/1", alias="schema")
    specimen: str = Field(description="damper under test, as the first log names it")
    drive_kind: str = Field(description="driver_command_v, coil_v or coil_a")
    drive_unit: str = Field(description="V or A")
    drive_range: tuple[float, float] = Field(description="lowest and highest drive fitted, in `drive_unit`")
    parameters: dict[str, Estimate] = Field(description="the paper's fourteen")
    coordinates: dict[str, Estimate] = Field(description="the regular coordinates that the fit searched")
    nuisances: Nuisances
    noise_floor_n: float = Field(description="noise of the recorded force in N")
    floor: NoiseFloor
    rmse_n: Errors = Field(description="root mean square force error in N")
    nrmse: Errors = Field(description="that, over the standard deviation of the recorded force")
    per_drive: list[DriveError]
    stages: list[Stage]
    agreement: str | None = Field(
        description="whether the stages agree within their intervals; null for one stage"
    )
    agreement_deviations: dict[str, float] | None = Field(
        default=None,
        description="difference of the stages in each coordinate, over the larger of their standard deviations",
    )
    result: str = Field(description="`converged`, or why not")
    correlations: dict[str, float] = Field(
        description="pairs of coordinates correlated beyond 0.9, `a,b` -> value"
    )
    notes: list[str] = Field(
        default_factory=list, description="what was left out of the recordings, and what they cannot show"
    )
    covariance: list[list[float]] | None = Field(
        default=None, description="of the coordinates in their order, in their units; zero where nothing was seen"
    )
    provenance: Provenance

    def point(self) -> Coordinates:
        """The coordinates as numbers."""
        return Coordinates(**{name: e.value for name, e in self.coordinates.items()})


class Band(Document):
    """How far a predicted force may be off: a band of so many deviations about it."""

    level: float = Field(description="share of samples that are to lie inside, 0.95")
    half_width_n: float = Field(description="median half width in N")
    widest_n: float = Field(description="largest half width in N")
    noise_n: float = Field(description="standard deviation in N of the record's noise, and of what the fit left")
    parameters_n: float = Field(description="root mean square deviation in N that the uncertain parameters cause")
    inside: float | None = Field(description="share of the recorded samples inside; null where none was recorded")
    note: str = Field(
        description="where the band cannot be trusted, and why; empty where nothing is known against"
    )


class Prediction(Document):
    """A model simulated on a log that it never saw."""

    schema_: Literal["mrbench.prediction/1"] = Field(default="mrbench.prediction/1", alias="schema")
    rmse_n: float = Field(description="root mean square force error in N")
    nrmse: float = Field(description="that, over the standard deviation of the recorded force")
    bias_n: float = Field(description="mean of simulated minus recorded force in N")
    noise_floor_n: float = Field(description="noise of the recorded force in N")
    per_drive: list[DriveError]
    samples: int = Field(description="how many samples")
    freed: list[str] = Field(description="what was estimated on this very log")
    before_n: float | None = Field(default=None, description="of a twin: that of its fit without effects, in N")
    shrinkage: float | None = Field(
        default=None, description="of a twin: 1 - (after² - floor²)/(before² - floor²); null near the floor"
    )
    band: Band | None = Field(
        default=None, description="95 % band of the force; null for a model without intervals"
    )
    provenance: Provenance


class Forecast(Document):
    """A fit on planned strokes, before anything is recorded."""

    schema_: Literal["mrbench.forecast/1"] = Field(default="mrbench.forecast/1", alias="schema")
    method: str = Field(description="the planned strokes")
    samples: int = Field(description="how many samples")
    largest_force_n: float = Field(description="largest magnitude of the force in N")
    band: Band = Field(description="95 % band of the force")
    provenance: Provenance


def read_fit(path: Path) -> Fit:
    """A fit from its file.

    Raises:
        IdentificationError: the file is missing or is no fit.
    """
    try:
        return Fit.model_validate_json(path.read_bytes())
    except OSError as error:
        raise IdentificationError(
            f"{path}: cannot be read ({error.strerror}); give a fit made by `identify`"
        ) from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the file"
        raise IdentificationError(
            f"{path}: no {FIT_SCHEMA} document ({place}: {first['msg'][:80]}); give one made by `mrbench identify`"
        ) from error
