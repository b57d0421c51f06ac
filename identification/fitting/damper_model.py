"""Damper model with effects, read from a fit, a twin or a scenario."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from identification.arrays import Array
from identification.damper import PARAMETER_SETS, Coordinates, Parameters, to_coordinates
from identification.damper.definitions import EffectFile, find_effect_file, load_effects, make_effect
from identification.damper.effects import EFFECTS, rename_parameters
from identification.documents import Fit, Nuisances, TwinResidual
from identification.errors import IdentificationError
from identification.fitting.piece import Piece
from identification.fitting.prediction import PiecePrediction, predict_piece
from identification.residual import LearnedResidual
from identification.simulate import ActiveEffect
from identification.validation import describe_validation_error

_ADVICE = "give a fit, a twin or a scenario"


@dataclass(frozen=True)
class DamperModel:
    """A damper that can be simulated on any recording."""

    coordinates: Coordinates
    effects: tuple[ActiveEffect, ...] = ()
    delays: tuple[float, float] = (0.0, 0.0)
    """Residual delays of force and drive channel in the fit or twin [s]."""
    baseline: Fit | None = None
    """Fit without effects of a twin."""
    residual: LearnedResidual | None = None
    """Learned residual of a twin; `predict` and `simulate_force` do not include it."""

    def simulate_force(self, piece: Piece) -> Array:
        """Return the simulated force (N,) [N] of a piece, with y(0) fitted to it."""
        return self.predict(piece).force

    def predict(self, piece: Piece, *, free_offset: bool = False) -> PiecePrediction:
        """Simulate a piece with y(0), and on request a force offset, fitted to it."""
        return predict_piece(piece, self.coordinates, self.delays, effects=self.effects, free_offset=free_offset)


def read_damper_model(path: Path) -> DamperModel:
    """Read the model in a fit, twin or scenario.

    Raises:
        IdentificationError: as `read_fit_or_model` does.
    """
    document = read_fit_or_model(path)
    return make_damper_model(document) if isinstance(document, Fit) else document


def read_fit_or_model(path: Path) -> Fit | DamperModel:
    """Read a fit, or the model in a twin or scenario.

    Raises:
        IdentificationError: the file is missing, is of another kind, or names an unknown effect.
    """
    content = _read_json(path)
    schema = content.get("schema") if isinstance(content, dict) else None
    try:
        if schema == "mrbench.fit/1":
            return Fit.model_validate(content)
        if schema == "mrbench.scenario/1":
            return _parse_scenario(content)
    except (ValidationError, KeyError, TypeError, ValueError) as error:
        raise IdentificationError(f"{path}: {_describe_error(error)}; {_ADVICE}") from error
    raise IdentificationError(f"{path}: unexpected schema {schema!r}; {_ADVICE}")


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_bytes())
    except OSError as error:
        raise IdentificationError(f"{path}: cannot be read ({error.strerror}); {_ADVICE}") from error
    except ValueError as error:
        raise IdentificationError(f"{path}: not a JSON document ({error}); {_ADVICE}") from error


def make_damper_model(fit: Fit) -> DamperModel:
    """Return the damper of a fit as a model, with the delays of its bench."""
    return DamperModel(fit.to_coordinates(), (), _get_delays(fit.nuisances))


def _get_delays(nuisances: Nuisances) -> tuple[float, float]:
    return nuisances.force_delay.value, nuisances.drive_delay.value


def _parse_scenario(content: dict[str, Any]) -> DamperModel:
    damper = content.get("damper", "laboratory")
    parameters = PARAMETER_SETS[damper].parameters if isinstance(damper, str) else Parameters(**damper)
    effects = tuple(_parse_effect(entry) for entry in content.get("effects", ()))
    baseline, residual = content.get("baseline"), content.get("residual")
    # A scenario has no residual delays, because the devices of a simulated rig report theirs in every log. The
    # parameters of a twin were fitted together with the delays of its bench, and fit worse without them.
    nuisances = content.get("nuisances")
    return DamperModel(
        to_coordinates(parameters),
        effects,
        (0.0, 0.0) if nuisances is None else _get_delays(Nuisances.model_validate(nuisances)),
        None if baseline is None else Fit.model_validate(baseline),
        None if residual is None else LearnedResidual(TwinResidual.model_validate(residual)),
    )


def _parse_effect(entry: dict[str, Any]) -> ActiveEffect:
    """Return an effect of the library, of the entry's own definition, or of the user's effect files."""
    definition = entry.get("definition")
    if definition is not None:
        effect = make_effect(EffectFile.model_validate(definition))
    else:
        effect = EFFECTS[entry["name"]] if entry["name"] in EFFECTS else load_effects()[entry["name"]]
    form = effect.find_form(entry.get("form"))
    parameters = rename_parameters(effect.name, entry["parameters"])
    values = tuple(float(parameters[q.symbol]) for q in form.parameters)
    return ActiveEffect(effect, values, form.name)


def _describe_error(error: Exception) -> str:
    if isinstance(error, ValidationError):
        return describe_validation_error(error)
    if isinstance(error, KeyError):
        return f"{error.args[0]!r} is missing, or not in the library of effects"
    return str(error)[:120]


def make_effect_entries(effects: Sequence[ActiveEffect]) -> list[dict[str, Any]]:
    """Return effects as entries of a scenario; a defined effect brings its definition along."""
    return [
        {
            "name": e.effect.name,
            "form": e.form.name,
            "parameters": {q.symbol: float(v) for q, v in zip(e.form.parameters, e.values, strict=True)},
            **({"definition": file} if (file := find_effect_file(e.effect)) else {}),
        }
        for e in effects
    ]
