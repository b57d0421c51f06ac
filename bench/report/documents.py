"""What a report reads of a fit and of a prediction: their JSON, as plain data.

The bench and the identification meet through files, so these types name only what a report shows and let every
other key pass.
"""

from pathlib import Path
from typing import Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bench.errors import ReportError
from bench.faults import first_fault


class Part(BaseModel):
    """Part of a document: frozen; keys that no report shows are let pass."""

    model_config = ConfigDict(frozen=True, extra="ignore", populate_by_name=True)


class Estimate(Part):
    """One number and how well it is known."""

    value: float = Field(description="best value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] | None = Field(description="95 % interval, in `unit`; null where nothing bounds it")
    identifiable: bool = Field(description="whether the strokes fix it")
    note: str = Field(default="", description="what to know about it")


class Delay(Part):
    """A lag that had to be estimated."""

    value: float = Field(description="lag in s")
    ci95: tuple[float, float] | None = Field(default=None, description="95 % interval in s")
    prior_sd: float = Field(description="standard deviation allowed beforehand, in s")
    outside_prior: bool = Field(default=False, description="whether it is more than the clocks explain")


class Nuisances(Part):
    """What was estimated along with the damper."""

    y0: dict[str, float] = Field(description="inner displacement at the start of each stretch, in m")
    force_delay: Delay = Field(description="lag of the force behind the displacement")
    drive_delay: Delay = Field(description="further lag of the force behind the drive")


class Floor(Part):
    """Noise of the recorded force."""

    cycle_to_cycle: float | None = Field(description="from repeated cycles, in N")
    high_frequency: float = Field(description="from what is too swift for a damper, in N")
    how: str = Field(description="which was used, and why")


class Errors(Part):
    """One measure of the force error, by what the fit saw."""

    train: float = Field(description="on the samples fitted")
    held_out: float | None = Field(default=None, description="on the samples held out")


class DriveError(Part):
    """Force error at one drive."""

    drive: float = Field(description="drive, in `unit`")
    unit: str = Field(description="V or A")
    rmse_n: float = Field(description="root mean square force error in N")
    nrmse: float = Field(description="that, over the standard deviation of the force")
    samples: int = Field(description="how many samples")


class Stage(Part):
    """One stage of a fit."""

    name: str = Field(description="which")
    seconds: float = Field(description="processor time in s")
    rmse_n: float = Field(description="force error after it, in N")
    iterations: int | None = Field(default=None, description="how many steps")
    note: str = Field(default="", description="what to know about it")


class Provenance(Part):
    """What a document was made from."""

    logs: dict[str, str] = Field(description="file name -> SHA-256 of its content")
    version: str = Field(description="of the program")
    seed: int = Field(description="of everything random")
    settings: dict[str, str | float | int | bool | None] = Field(description="as asked")


class Fit(Part):
    """An identified damper."""

    schema_: Literal["mrbench.fit/1"] = Field(alias="schema")
    specimen: str = Field(description="the damper")
    drive_unit: str = Field(description="V or A")
    drive_range: tuple[float, float] = Field(description="lowest and highest drive fitted, in `drive_unit`")
    parameters: dict[str, Estimate] = Field(description="the paper's fourteen")
    coordinates: dict[str, Estimate] = Field(description="the regular coordinates")
    nuisances: Nuisances
    noise_floor_n: float = Field(description="noise of the recorded force in N")
    floor: Floor
    rmse_n: Errors = Field(description="root mean square force error in N")
    nrmse: Errors = Field(description="that, over the standard deviation of the recorded force")
    per_drive: list[DriveError]
    stages: list[Stage]
    agreement: str | None = Field(description="whether the stages agree")
    result: str = Field(description="`converged`, or why not")
    correlations: dict[str, float] = Field(description="`a,b` -> correlation beyond 0.9")
    provenance: Provenance

    def saw(self, sha256: str) -> bool:
        """Whether the log of this content was among those fitted."""
        return sha256 in self.provenance.logs.values()


class Prediction(Part):
    """A fit simulated on one log."""

    schema_: Literal["mrbench.prediction/1"] = Field(alias="schema")
    rmse_n: float = Field(description="root mean square force error in N")
    nrmse: float = Field(description="that, over the standard deviation of the recorded force")
    bias_n: float = Field(description="mean of simulated minus recorded force in N")
    noise_floor_n: float = Field(description="noise of the recorded force in N")
    per_drive: list[DriveError]
    samples: int = Field(description="how many samples")
    freed: list[str] = Field(description="what was estimated on this very log")


Document = TypeVar("Document", bound=Part)


def read_fit(path: Path) -> Fit:
    """A fit from its file.

    Raises:
        ReportError: there is no such file, or it is no fit.
    """
    return read_document(path, Fit, "a fit made by `mrbench identify`")


def read_prediction(path: Path) -> Prediction:
    """A prediction from its file.

    Raises:
        ReportError: there is no such file, or it is no prediction.
    """
    return read_document(path, Prediction, "a prediction made by `mrbench predict`")


def read_document(path: Path, kind: type[Document], wanted: str) -> Document:
    """A document of one kind from its file.

    Args:
        path: of the file.
        kind: its type.
        wanted: what should have been given, for a person.

    Raises:
        ReportError: there is no such file, or it is something else.
    """
    try:
        return kind.model_validate_json(path.read_bytes())
    except OSError as error:
        raise ReportError(f"{path}: cannot be read ({error.strerror}); give {wanted}") from error
    except ValidationError as error:
        first, words = first_fault(error)
        where = ".".join(str(step) for step in first["loc"])
        raise ReportError(f"{path}: not {wanted} ({': '.join(filter(None, (where, words)))})") from error
