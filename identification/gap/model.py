"""A damper with effects, from whatever document names one: a fit, a twin or a scenario."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from identification.arrays import Array
from identification.damper.coordinates import Coordinates, to_coordinates
from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.damper.parameters import Parameters
from identification.errors import IdentificationError
from identification.piece import Piece
from identification.prediction import Predicted, predict_piece
from identification.results import Fit, Nuisances
from identification.simulate import ActiveEffect


@dataclass(frozen=True)
class Model:
    """Something that can be simulated on any recording."""

    point: Coordinates
    effects: tuple[ActiveEffect, ...] = ()
    delays: tuple[float, float] = (0.0, 0.0)
    """[s] residual lags of the force and drive channel that came with a fit or a twin."""
    baseline: Fit | None = None
    """Of a twin: the fit without effects."""

    def force_on(self, piece: Piece) -> Array:
        """Simulated force (N,) [N] of a stretch; only y(0) is found on it, by Gauss-Newton."""
        return self.on(piece).force

    def on(self, piece: Piece, *, free_offset: bool = False) -> Predicted:
        """A stretch simulated with y(0), and on request a force offset, found on it."""
        return predict_piece(piece, self.point, self.delays, effects=self.effects, free_offset=free_offset)


def read_model(path: Path) -> Model:
    """The model in a fit, twin or scenario.

    Raises:
        IdentificationError: as `read_fit_or_model` does.
    """
    found = read_fit_or_model(path)
    return model_of_fit(found) if isinstance(found, Fit) else found


def read_fit_or_model(path: Path) -> Fit | Model:
    """A fit from its file, or the model in a twin or scenario.

    Raises:
        IdentificationError: the file is missing, is none of them, or names an effect that is not known.
    """
    try:
        content = json.loads(path.read_bytes())
        schema = content.get("schema") if isinstance(content, dict) else None
    except OSError as error:
        raise IdentificationError(
            f"{path}: cannot be read ({error.strerror}); give a fit, a twin or a scenario"
        ) from error
    except ValueError as error:
        raise IdentificationError(f"{path}: no JSON ({error}); give a fit, a twin or a scenario") from error
    try:
        if schema == "mrbench.fit/1":
            return Fit.model_validate(content)
        if schema == "mrbench.scenario/1":
            return _of_scenario(content)
    except (ValidationError, KeyError, TypeError, ValueError) as error:
        raise IdentificationError(f"{path}: {_said(error)}; give a fit, a twin or a scenario") from error
    raise IdentificationError(f"{path}: its schema is {schema!r}; give a fit, a twin or a scenario")


def model_of_fit(fit: Fit) -> Model:
    """A fit as a model, with the lags of its bench."""
    return Model(fit.point(), (), _lags(fit.nuisances))


def _lags(nuisances: Nuisances) -> tuple[float, float]:
    return nuisances.force_delay.value, nuisances.drive_delay.value


def _of_scenario(content: dict[str, Any]) -> Model:
    damper = content.get("damper", "laboratory")
    parameters = PARAMETER_SETS[damper].parameters if isinstance(damper, str) else Parameters(**damper)
    effects = tuple(_active(e) for e in content.get("effects", ()))
    given = content.get("baseline")
    baseline = None if given is None else Fit.model_validate(given)
    # The truth of a rig says nothing of channel delays: what its devices report stands in every log. A twin does:
    # its parameters were fitted beside the lags of its bench, and leave more without them.
    found = content.get("nuisances")
    lags = (0.0, 0.0) if found is None else _lags(Nuisances.model_validate(found))
    return Model(to_coordinates(parameters), effects, lags, baseline)


def _active(entry: dict[str, Any]) -> ActiveEffect:
    effect = EFFECTS[entry["name"]]
    form = effect.form(entry.get("form"))
    values = tuple(float(entry["parameters"][q.symbol]) for q in form.parameters)
    return ActiveEffect(effect, values, form.name)


def _said(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return f"{'.'.join(str(p) for p in first['loc'])}: {first['msg']}"[:120]
    if isinstance(error, KeyError):
        return f"no {error.args[0]!r} there or in the library"
    return str(error)[:120]


def named_effects(effects: Sequence[ActiveEffect]) -> list[dict[str, Any]]:
    """Effects as a scenario names them."""
    return [
        {
            "name": e.effect.name,
            "form": e.form.name,
            "parameters": {q.symbol: float(v) for q, v in zip(e.form.parameters, e.values, strict=True)},
        }
        for e in effects
    ]
