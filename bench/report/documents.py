"""Fit and prediction in a report: the parts of their JSON documents that a report shows.

Bench and identification exchange these documents as files, so these types are a hand-kept mirror and ignore all
other keys. A contract test compares them with the JSON Schemas in `docs/reference/schemas`.
"""

from pathlib import Path
from typing import Literal, TypeVar

from pydantic import AliasChoices, BaseModel, ConfigDict, Field, ValidationError

from bench.errors import ReportError
from bench.validation import describe_validation_error


class DocumentPart(BaseModel):
    """Part of a document: frozen; keys that no report shows are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", populate_by_name=True)


class Estimate(DocumentPart):
    """Estimate of one parameter with its uncertainty."""

    value: float = Field(description="best value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] | None = Field(description="95 % interval, in `unit`; null if unbounded")
    identifiable: bool = Field(description="whether the strokes determine the parameter")
    note: str = Field(default="", description="note for a person")


class ParameterValue(DocumentPart):
    """One parameter of an effect or symbol of a formula."""

    value: float = Field(description="best value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] | None = Field(default=None, description="95 % interval, in `unit`")


class DelayEstimate(DocumentPart):
    """Estimate of a residual delay."""

    value: float = Field(description="delay in s")
    ci95: tuple[float, float] | None = Field(default=None, description="95 % interval in s")
    prior_sd: float = Field(description="standard deviation of the prior, in s")
    outside_prior: bool = Field(default=False, description="whether the delay exceeds what clock errors explain")


class Nuisances(DocumentPart):
    """Quantities estimated together with the damper."""

    y0: dict[str, float] = Field(description="inner displacement at the start of each stretch, in m")
    force_delay: DelayEstimate = Field(description="delay of the force behind the displacement")
    drive_delay: DelayEstimate = Field(description="additional delay of the force behind the drive")


class NoiseFloor(DocumentPart):
    """Noise floor of the recorded force."""

    cycle_to_cycle: float | None = Field(description="from repeated cycles, in N")
    high_frequency: float = Field(description="from frequencies above those of a damper, in N")
    basis: str = Field(
        validation_alias=AliasChoices("basis", "how"), description="estimate on which the noise floor rests"
    )
    ci95: tuple[float, float] | None = Field(default=None, description="95 % interval of the noise floor, in N")


class ForceErrors(DocumentPart):
    """Force error on the samples that a fit used, and on those that it did not use."""

    train: float = Field(description="on the samples fitted")
    held_out: float | None = Field(default=None, description="on the samples held out")


class DriveError(DocumentPart):
    """Force error at one drive."""

    drive: float = Field(description="drive, in `unit`")
    unit: str = Field(description="V or A")
    rmse_n: float = Field(description="root mean square force error in N")
    nrmse: float = Field(description="RMSE over the standard deviation of the force")
    samples: int = Field(description="number of samples")


class FitStage(DocumentPart):
    """One stage of a fit."""

    name: str = Field(description="name of the stage")
    seconds: float = Field(description="processor time in s")
    rmse_n: float = Field(description="force error at its end, in N")
    iterations: int | None = Field(default=None, description="number of iterations")
    note: str = Field(default="", description="note for a person")


class Provenance(DocumentPart):
    """Logs, program and settings of a document."""

    logs: dict[str, str] = Field(description="SHA-256 of each log by its file name")
    version: str = Field(description="version of the program")
    seed: int = Field(description="seed of all random numbers")
    settings: dict[str, str | float | int | bool | None] = Field(description="requested settings")


class Fit(DocumentPart):
    """An identified damper."""

    schema_: Literal["mrbench.fit/1"] = Field(alias="schema")
    specimen: str = Field(description="damper under test")
    drive_unit: str = Field(description="V or A")
    drive_range: tuple[float, float] = Field(description="lowest and highest drive fitted, in `drive_unit`")
    parameters: dict[str, Estimate] = Field(description="fourteen parameters of the paper")
    coordinates: dict[str, Estimate] = Field(description="regular coordinates")
    nuisances: Nuisances
    noise_floor_n: float = Field(description="noise floor of the recorded force in N")
    floor: NoiseFloor
    rmse_n: ForceErrors = Field(description="root mean square force error in N")
    nrmse: ForceErrors = Field(description="RMSE over the standard deviation of the recorded force")
    per_drive: list[DriveError]
    stages: list[FitStage]
    agreement: str | None = Field(description="whether the stages agree")
    result: str = Field(description="`converged`, or the reason why not")
    correlations: dict[str, float] = Field(description="correlations beyond 0.9 by pair `a,b`")
    provenance: Provenance

    def has_fitted(self, sha256: str) -> bool:
        """Return whether the log with this content was fitted."""
        return sha256 in self.provenance.logs.values()


class ForceError(DocumentPart):
    """Force error of one model."""

    rmse_n: float = Field(description="root mean square force error in N")
    nrmse: float = Field(description="RMSE over the standard deviation of the recorded force")


class Prediction(DocumentPart):
    """A fit simulated on one log."""

    schema_: Literal["mrbench.prediction/1"] = Field(alias="schema")
    rmse_n: float = Field(description="root mean square force error in N")
    nrmse: float = Field(description="RMSE over the standard deviation of the recorded force")
    bias_n: float = Field(description="mean of simulated minus recorded force in N")
    noise_floor_n: float = Field(description="noise floor of the recorded force in N")
    per_drive: list[DriveError]
    samples: int = Field(description="number of samples")
    freed: list[str] = Field(description="quantities that were estimated on this log")
    before_n: float | None = Field(default=None, description="of a twin: force error without its effects, in N")
    physics: ForceError | None = Field(default=None, description="of a twin: without its learned residual")


DocumentT = TypeVar("DocumentT", bound=DocumentPart)


def read_fit(path: Path) -> Fit:
    """Read a fit from its file.

    Raises:
        ReportError: the file cannot be read or is not a fit.
    """
    return read_document(path, Fit, "a fit written by `mrbench identify`")


def read_prediction(path: Path) -> Prediction:
    """Read a prediction from its file.

    Raises:
        ReportError: the file cannot be read or is not a prediction.
    """
    return read_document(path, Prediction, "a prediction written by `mrbench predict`")


def read_document(path: Path, model: type[DocumentT], expected: str) -> DocumentT:
    """Read a document from its file.

    Args:
        path: file of the document.
        model: type of the document.
        expected: description of the document for messages.

    Raises:
        ReportError: the file cannot be read or is another document.
    """
    try:
        return model.model_validate_json(path.read_bytes())
    except OSError as error:
        raise ReportError(f"{path}: cannot be read ({error.strerror}); give {expected}") from error
    except ValidationError as error:
        raise ReportError(f"{path}: not {expected} ({describe_validation_error(error)})") from error
