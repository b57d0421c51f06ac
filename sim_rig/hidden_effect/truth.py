"""Truth file ``mrbench.truth/1``: the effect that a drawn damper has, written for a person who opens it last."""

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from sim_rig.effect_forms import FORMS
from sim_rig.errors import TruthError
from sim_rig.scenario import Scenario
from sim_rig.validation import FrozenModel


class TrueParameter(FrozenModel):
    """One parameter of the hidden effect."""

    value: float = Field(description="value, in `unit`")
    unit: str = Field(description="SI unit")
    meaning: str = Field(description="one line for a person")


class Truth(FrozenModel):
    """The hidden effect of a drawn damper."""

    schema_: Literal["mrbench.truth/1"] = Field(alias="schema", description="kind and version of this document")
    seed: int = Field(ge=0, description="seed of the draw")
    effect: str = Field(description="name of the effect, as a diagnosis would give it")
    meaning: str = Field(description="one line for a person")
    stage: str = Field(description="its stage of the measurement chain")
    place: str = Field(description="place in the chain at which the rig plays it")
    form: str = Field(description="functional form, one of the blind trial")
    parameters: dict[str, TrueParameter] = Field(description="parameters of the form by symbol; first its size")
    scenario: dict[str, Any] = Field(description="the document `mrbench.scenario/1` that is played")


def make_truth(scenario: Scenario) -> Truth:
    """Return the truth of a drawn scenario, which has one alternative effect."""
    (effect,) = scenario.alternative_effects
    form = FORMS[str(effect.form)]
    parameters = {
        quantity.symbol: TrueParameter(
            value=effect.parameters[quantity.symbol],
            unit=quantity.format_unit(scenario.drive_unit),
            meaning=quantity.meaning,
        )
        for quantity in form.parameters
    }
    return Truth(
        schema="mrbench.truth/1",
        seed=scenario.seed,
        effect=form.effect,
        meaning=form.meaning,
        stage=form.stage,
        place=form.place.name.lower(),
        form=form.form,
        parameters=parameters,
        scenario=scenario.model_dump(by_alias=True, mode="json", exclude_defaults=True),
    )


def write_truth(path: Path, truth: Truth) -> None:
    """Write a truth file, readable by its owner only; a truth file that is already there is replaced.

    Raises:
        TruthError: the file cannot be written, or exists and is not a truth file.
    """
    try:
        if path.exists() and not _is_truth(path):
            raise TruthError(
                f"{path}: exists and is not a truth file, so it is not replaced; choose another --truth"
            )
        draft = path.with_name(f".{path.name}.draft")
        draft.touch(mode=0o600)
        draft.write_text(truth.model_dump_json(by_alias=True, indent=2) + "\n", "utf-8")
        draft.replace(path)
    except OSError as error:
        raise TruthError(f"{path}: cannot be written ({error.strerror}); choose another --truth") from error


def _is_truth(path: Path) -> bool:
    try:
        Truth.model_validate_json(path.read_bytes())
    except ValidationError:
        return False
    return True
