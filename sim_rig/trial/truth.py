"""What is sealed: every case of a trial with its effects and the scenario that plays them."""

import hashlib
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sim_rig.errors import TrialError

CaseKind = Literal["nothing", "single", "pair", "triple", "unknown"]
MethodKind = Literal["rich", "poor"]
Magnitude = Literal["small", "large"]


class Document(BaseModel):
    """Base of the trial's documents: frozen, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


class TrueEffect(Document):
    """One effect that is really at work."""

    name: str = Field(description="as a diagnosis would name it, or a name that no library has")
    form: str = Field(description="sealed form that is played")
    stage: str = Field(description="its place in the chain")
    known: bool = Field(description="whether the library is to know an effect of this name")
    parameters: dict[str, float] = Field(description="[SI] values of the sealed form")
    ratio: float = Field(
        description="[1] refitted law without it over the noise floor, if it were alone; to first order"
    )


class TrueCase(Document):
    """One case before anything is recorded."""

    id: str = Field(description="name of the case")
    kind: CaseKind = Field(description="how many effects, and whether the library is to know them")
    magnitude: Magnitude | None = Field(description="size of its effects; null for nothing")
    method: MethodKind = Field(description="several strokes with rests, or one amplitude at one frequency")
    variant: int = Field(description="which of the methods of its kind")
    damper: str = Field(description="small, middle or large")
    noise: Literal["white", "coloured"] = Field(description="of the load cell")
    effects: tuple[TrueEffect, ...] = Field(description="what is at work")
    seed: int = Field(description="of what chance decides on the rig")
    scenario: dict[str, Any] = Field(description="the document `mrbench.scenario/1` that is played")


class Truth(Document):
    """All cases of a trial."""

    cases: tuple[TrueCase, ...]


def write_sealed(path: Path, truth: Truth) -> str:
    """Write the truth and return the SHA-256 by which it is known from now on."""
    content = (truth.model_dump_json(indent=1) + "\n").encode()
    partial = path.with_name(path.name + ".partial")
    partial.write_bytes(content)
    partial.replace(path)
    return hashlib.sha256(content).hexdigest()


def read_sealed(path: Path, sha256: str) -> Truth:
    """The truth, if it is the one that was sealed.

    Raises:
        TrialError: the file is gone, was changed since, or holds no truth.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise TrialError(
            f"{path}: the sealed truth cannot be read ({error.strerror}); begin a new trial"
        ) from error
    found = hashlib.sha256(content).hexdigest()
    if found != sha256:
        raise TrialError(
            f"{path}: the seal is broken: its SHA-256 is {found[:12]}..., published was {sha256[:12]}...; "
            "begin a new trial"
        )
    try:
        return Truth.model_validate_json(content)
    except ValidationError as error:
        raise TrialError(
            f"{path}: sealed by another version ({error.error_count()} faults); begin anew"
        ) from error
