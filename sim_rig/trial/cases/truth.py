"""Sealed truth of a trial: every case with its effects and the scenario that plays them."""

import hashlib
from pathlib import Path
from typing import Any, Literal

from pydantic import AliasChoices, Field, ValidationError

from sim_rig.errors import TrialError
from sim_rig.validation import FrozenModel

CaseKind = Literal["nothing", "single", "pair", "triple", "unknown"]
MethodKind = Literal["rich", "poor"]
Magnitude = Literal["small", "large"]


class TrueEffect(FrozenModel):
    """One effect that is active in a case."""

    name: str = Field(description="as a diagnosis would name it, or a name that the library does not have")
    form: str = Field(description="alternative form")
    stage: str = Field(description="its stage of the measurement chain")
    in_library: bool = Field(
        validation_alias=AliasChoices("in_library", "known"),
        description="whether the library has an effect of this name",
    )
    parameters: dict[str, float] = Field(description="[SI] values of the alternative form")
    ratio: float = Field(
        description="[1] error of the refitted law over the noise floor if it were alone, to first order"
    )


class TrueCase(FrozenModel):
    """One case before anything is recorded."""

    id: str = Field(description="name of the case")
    kind: CaseKind = Field(description="number of effects, and whether the library has them")
    magnitude: Magnitude | None = Field(description="size of its effects; null without effects")
    method: MethodKind = Field(description="several strokes with rests, or one amplitude at one frequency")
    variant: int = Field(description="index of the method among those of its kind")
    damper: str = Field(description="small, middle or large")
    noise: Literal["white", "coloured"] = Field(description="noise of the load cell")
    effects: tuple[TrueEffect, ...] = Field(description="active effects")
    seed: int = Field(description="seed of the rig's random errors")
    scenario: dict[str, Any] = Field(description="the document `mrbench.scenario/1` that is played")


class SealedTruth(FrozenModel):
    """All cases of a trial."""

    cases: tuple[TrueCase, ...]


def write_sealed_truth(path: Path, truth: SealedTruth) -> str:
    """Write the truth and return its SHA-256."""
    content = (truth.model_dump_json(indent=1) + "\n").encode()
    partial = path.with_name(path.name + ".partial")
    partial.write_bytes(content)
    partial.replace(path)
    return hashlib.sha256(content).hexdigest()


def read_sealed_truth(path: Path, sha256: str) -> SealedTruth:
    """Read the truth and check it against the published SHA-256.

    Raises:
        TrialError: the file is missing, was changed, or is not a sealed truth.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise TrialError(
            f"{path}: the sealed truth cannot be read ({error.strerror}); start a new trial"
        ) from error
    _check_seal(path, content, sha256)
    try:
        return SealedTruth.model_validate_json(content)
    except ValidationError as error:
        raise TrialError(
            f"{path}: sealed by an incompatible version ({error.error_count()} errors); start a new trial"
        ) from error


def _check_seal(path: Path, content: bytes, sha256: str) -> None:
    digest = hashlib.sha256(content).hexdigest()
    if digest != sha256:
        raise TrialError(
            f"{path}: the seal is broken: its SHA-256 is {digest[:12]}..., published was {sha256[:12]}...; "
            "start a new trial"
        )
