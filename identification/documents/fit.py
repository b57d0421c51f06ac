"""Documents of a fit and of its use: mrbench.fit/1, mrbench.prediction/1, mrbench.forecast/1.

Keys contain the unit where no description can (``rmse_n`` is in newton). Every other number has a separate field
for its unit. The JSON Schemas in docs/reference/schemas are generated from these types.
"""

from pathlib import Path
from typing import Literal

from pydantic import AliasChoices, Field, ValidationError

from identification.damper import Coordinates
from identification.documents.document import Document
from identification.errors import IdentificationError
from identification.validation import describe_validation_error

FIT_SCHEMA = "mrbench.fit/1"


class Estimate(Document):
    """One estimated number with its unit and its uncertainty."""

    value: float = Field(description="estimated value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] | None = Field(description="95 % interval, in `unit`; null where not observable")
    ci99: tuple[float, float] | None = Field(default=None, description="99 % interval, in `unit`")
    profile95: tuple[float, float] | None = Field(
        default=None, description="95 % interval by profile likelihood, in `unit`; on request"
    )
    identifiable: bool = Field(description="whether the strokes determine it to better than half its size")
    note: str = Field(default="", description="meaning and limits of the value")


class Delay(Document):
    """A lag between two channels, beyond the delays that the instruments report."""

    value: float = Field(description="lag in s")
    unit: Literal["s"] = "s"
    ci95: tuple[float, float] | None = Field(description="95 % interval in s")
    prior_sd: float = Field(description="standard deviation of its prior, in s")
    outside_prior: bool = Field(
        description="whether it is three or more standard deviations of its prior: too large for a clock error"
    )
    note: str = Field(default="", description="meaning and limits of the value")


class Nuisances(Document):
    """Quantities that were estimated together with the damper."""

    y0: dict[str, float] = Field(description="inner displacement at the start of each stretch, in m")
    force_delay: Delay = Field(description="lag of the force channel behind the displacement channel")
    drive_delay: Delay = Field(description="additional lag of the force channel behind the drive channel")
    per_log: dict[str, dict[str, Estimate]] = Field(
        default_factory=dict,
        validation_alias=AliasChoices("per_log", "each_log"),
        description="per-log parameters of each log after the first, by log and name; on request",
    )


class NoiseFloor(Document):
    """Noise of the recorded force, and the measurement that it rests on."""

    cycle_to_cycle: float | None = Field(description="from repeated cycles, in N; null where no cycles repeat")
    high_frequency: float = Field(description="from fourth differences, in N")
    basis: str = Field(
        validation_alias=AliasChoices("basis", "how"), description="which of the two was used, and why"
    )
    ci95: tuple[float, float] | None = Field(
        default=None,
        description="95 % interval of the noise floor, in N; where no cycles repeat, its lower bound and the "
        "error of the fit",
    )


class SplitErrors(Document):
    """One measure of the force error on fitted, validation and held-out samples."""

    train: float = Field(description="on the fitted samples")
    validation: float | None = Field(description="on the samples that choose settings; null where none do")
    held_out: float | None = Field(description="on the held-out samples; null where none are held out")


class DriveError(Document):
    """Force error at one drive, or in one bin of a varying drive."""

    drive: float = Field(description="drive, or middle of the bin, in `unit`")
    unit: str = Field(description="V or A")
    rmse_n: float = Field(description="root mean square force error, in N")
    nrmse: float = Field(description="`rmse_n` over the standard deviation of the recorded force in these samples")
    samples: int = Field(description="number of samples")


class FitStage(Document):
    """One stage of the fit."""

    name: str = Field(description="pinn or refine")
    seconds: float = Field(description="processor time in s")
    rmse_n: float = Field(description="error of the simulated force on the fitted samples after the stage, in N")
    iterations: int = Field(description="number of steps of the last minimisation")
    note: str = Field(default="", description="result and limits of the stage")
    simulated_n: SplitErrors | None = Field(
        default=None,
        description="pinn: error in N of the law simulated with the parameters found; it judges the parameters",
    )
    reconstructed_n: SplitErrors | None = Field(
        default=None, description="pinn: error in N of the network's own force; it hardly judges the parameters"
    )
    coordinates: dict[str, Estimate] | None = Field(
        default=None, description="coordinates found by this stage, if the fit rests on another stage"
    )


class Provenance(Document):
    """Data, version and settings that a document was made from."""

    logs: dict[str, str] = Field(description="file name -> SHA-256 of its content")
    version: str = Field(description="version of mrbench")
    seed: int = Field(description="seed of all random numbers")
    settings: dict[str, str | float | int | bool | None] = Field(description="settings of the computation")


class Fit(Document):
    """An identified damper."""

    schema_: Literal["mrbench.fit/1"] = Field(default="mrbench.fit/1", alias="schema")
    specimen: str = Field(description="damper under test, as named by the first log")
    drive_kind: str = Field(description="driver_command_v, coil_v or coil_a")
    drive_unit: str = Field(description="V or A")
    drive_range: tuple[float, float] = Field(description="lowest and highest fitted drive, in `drive_unit`")
    parameters: dict[str, Estimate] = Field(description="the fourteen parameters of the paper, by name")
    coordinates: dict[str, Estimate] = Field(description="the regular coordinates in which the fit searched")
    nuisances: Nuisances
    noise_floor_n: float = Field(description="noise of the recorded force, in N")
    floor: NoiseFloor
    rmse_n: SplitErrors = Field(description="root mean square force error, in N")
    nrmse: SplitErrors = Field(description="`rmse_n` over the standard deviation of the recorded force")
    per_drive: list[DriveError]
    stages: list[FitStage]
    agreement: str | None = Field(
        description="whether the stages agree within their intervals; null for one stage"
    )
    agreement_deviations: dict[str, float] | None = Field(
        default=None,
        description="difference of the stages in each coordinate, over the larger of their standard deviations",
    )
    result: str = Field(description="`converged`, or the reason why not")
    correlations: dict[str, float] = Field(
        description="pairs of coordinates with a correlation beyond 0.9, `a,b` -> value"
    )
    notes: list[str] = Field(
        default_factory=list, description="excluded samples, and limitations of the recordings"
    )
    covariance: list[list[float]] | None = Field(
        default=None, description="covariance of the coordinates, in their order and units; zero if not observable"
    )
    provenance: Provenance

    def to_coordinates(self) -> Coordinates:
        """Return the coordinates as numbers."""
        return Coordinates(**{name: e.value for name, e in self.coordinates.items()})


class Band(Document):
    """Uncertainty of a predicted force."""

    level: float = Field(description="share of samples expected inside the band, 0.95")
    half_width_n: float = Field(description="median half width, in N")
    widest_n: float = Field(description="largest half width, in N")
    noise_n: float = Field(description="standard deviation of noise and misfit of the fit, in N")
    parameters_n: float = Field(description="root mean square deviation due to uncertain parameters, in N")
    coverage: float | None = Field(
        validation_alias=AliasChoices("coverage", "inside"),
        description="share of the recorded samples inside the band; null where none was recorded",
    )
    note: str = Field(description="limitations of the band; empty where none are known")


class ForceError(Document):
    """Force error of one model."""

    rmse_n: float = Field(description="root mean square force error, in N")
    nrmse: float = Field(description="`rmse_n` over the standard deviation of the recorded force")


class Prediction(Document):
    """A model simulated on a log that was not fitted."""

    schema_: Literal["mrbench.prediction/1"] = Field(default="mrbench.prediction/1", alias="schema")
    rmse_n: float = Field(description="root mean square force error, in N")
    nrmse: float = Field(description="`rmse_n` over the standard deviation of the recorded force")
    bias_n: float = Field(description="mean of simulated less recorded force, in N")
    noise_floor_n: float = Field(description="noise of the recorded force, in N, at most `rmse_n`")
    per_drive: list[DriveError]
    samples: int = Field(description="number of samples")
    freed: list[str] = Field(description="quantities estimated on this log")
    before_n: float | None = Field(default=None, description="twin: RMSE of its fit without effects, in N")
    shrinkage: float | None = Field(
        default=None,
        description="twin: 1 - (after² - floor²)/(before² - floor²) of the physics; null near the floor",
    )
    physics: ForceError | None = Field(
        default=None, description="the same without the learned residual of a twin; null where it has none"
    )
    band: Band | None = Field(
        default=None, description="95 % band of the force; null for a model without intervals"
    )
    provenance: Provenance


class Forecast(Document):
    """A fit simulated on planned strokes."""

    schema_: Literal["mrbench.forecast/1"] = Field(default="mrbench.forecast/1", alias="schema")
    method: str = Field(description="the planned strokes")
    samples: int = Field(description="number of samples")
    largest_force_n: float = Field(description="largest magnitude of the force, in N")
    band: Band = Field(description="95 % band of the force")
    provenance: Provenance


def read_fit(path: Path) -> Fit:
    """Read a fit from its file.

    Raises:
        IdentificationError: the file is missing or is not a fit.
    """
    try:
        return Fit.model_validate_json(path.read_bytes())
    except OSError as error:
        raise IdentificationError(
            f"{path}: cannot be read ({error.strerror}); give a fit made by `identify`"
        ) from error
    except ValidationError as error:
        raise IdentificationError(
            f"{path}: not a {FIT_SCHEMA} document ({describe_validation_error(error)}); "
            "give one made by `mrbench identify`"
        ) from error
