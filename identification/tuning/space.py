"""Search space of a tuning study: the varied settings of each network, and their names in stored studies.

Stored studies keep the parameter names with which studies began, so that earlier studies can be continued. The
names of settings that were renamed since are mapped here.
"""

from collections.abc import Callable
from typing import Any

from optuna import Trial

from identification.pinn.common import (
    FEATURE_GROUPS,
    DenseSettings,
    ElementSettings,
    PaperSettings,
    PinnSettings,
)

_LAYER_FIELDS = ("units", "rank", "points")
"""Varied fields of the first hidden layer."""
_STAGE_FIELDS = {"physics": "law_weight", "meshes": "meshes", "thin": "decimation"}
"""Varied fields of the last training stage, by stored name."""
_ELEMENT_FIELDS = {"multipliers": "multiplier_steps", "activation": "activation", "features": "element_input"}
"""Other varied fields of the network of elements, by stored name."""
_DENSE_FIELDS = ("width", "layers", "samples", "steps")
_PAPER_FIELDS = ("width", "layers", "phi_data", "phi_phys", "learning_rate", "samples")
_NO_GROUP = "nothing"
"""Stored value of a trial that leaves no group of inputs out."""
_DENSE_LABELS = {"first_physics": "first_law_weight", "last_physics": "last_law_weight"}


def suggest_settings(trial: Trial, preset: PinnSettings) -> PinnSettings:
    """Return a preset with the values that a study suggests for a trial."""
    return apply_values(preset, _SUGGESTIONS[preset.network](trial))


def apply_values(preset: PinnSettings, values: dict[str, Any]) -> PinnSettings:
    """Return a preset with values by their stored names."""
    match preset:
        case ElementSettings():
            return _apply_element_values(preset, values)
        case DenseSettings():
            return _apply_dense_values(preset, values)
        case PaperSettings():
            return preset.model_copy(update=values)


def extract_values(preset: PinnSettings) -> dict[str, Any]:
    """Return a preset's own values of the varied settings, by their stored names."""
    match preset:
        case ElementSettings(layers=(layer, *_), schedule=(*_, stage)):
            return (
                {name: getattr(layer, name) for name in _LAYER_FIELDS}
                | {name: getattr(stage, field) for name, field in _STAGE_FIELDS.items()}
                | {name: getattr(preset, field) for name, field in _ELEMENT_FIELDS.items()}
            )
        case DenseSettings(law_weights=(first_weight, last_weight)):
            without = next((name for name in FEATURE_GROUPS if name not in preset.features), _NO_GROUP)
            values = {name: getattr(preset, name) for name in _DENSE_FIELDS}
            return values | {"first_physics": first_weight, "last_physics": last_weight, "without": without}
        case _:
            return {name: getattr(preset, name) for name in _PAPER_FIELDS}


def describe_parameter(name: str, network: str) -> str:
    """Return the present name of a stored parameter of a network, for a summary."""
    labels = {"elements": _STAGE_FIELDS | _ELEMENT_FIELDS, "dense": _DENSE_LABELS}
    return labels.get(network, {}).get(name, name)


def _apply_element_values(preset: ElementSettings, values: dict[str, Any]) -> ElementSettings:
    first, *larger = preset.layers
    *early, last = preset.schedule
    first = first.model_copy(update={name: values[name] for name in _LAYER_FIELDS})
    last = last.model_copy(update={field: values[name] for name, field in _STAGE_FIELDS.items()})
    others = {field: values[name] for name, field in _ELEMENT_FIELDS.items()}
    # A further layer that is not larger than the first one cannot improve the solution.
    layers = (first, *(layer for layer in larger if layer.rank > first.rank))
    return preset.model_copy(update=others | {"layers": layers, "schedule": (*early, last)})


def _apply_dense_values(preset: DenseSettings, values: dict[str, Any]) -> DenseSettings:
    others = {name: values[name] for name in _DENSE_FIELDS}
    weights = (values["first_physics"], values["last_physics"])
    features = tuple(name for name in FEATURE_GROUPS if name != values["without"])
    return preset.model_copy(update=others | {"law_weights": weights, "features": features})


def _suggest_elements(trial: Trial) -> dict[str, Any]:
    return {
        "rank": trial.suggest_int("rank", 24, 60, step=4),
        "units": trial.suggest_int("units", 80, 320, step=20),
        "points": trial.suggest_int("points", 60, 128, step=4),
        "activation": trial.suggest_categorical("activation", ["tanh", "sine", "gaussian"]),
        "features": trial.suggest_categorical("features", ["slip", "time", "stroke"]),
        "physics": trial.suggest_float("physics", 5.0, 300.0, log=True),
        "meshes": trial.suggest_int("meshes", 2, 12),
        "thin": trial.suggest_int("thin", 1, 4),
        "multipliers": trial.suggest_int("multipliers", 0, 6),
    }


def _suggest_dense(trial: Trial) -> dict[str, Any]:
    return {
        "width": trial.suggest_int("width", 10, 40, step=2),
        "layers": trial.suggest_int("layers", 1, 3),
        "without": trial.suggest_categorical("without", [_NO_GROUP, *FEATURE_GROUPS]),
        "samples": trial.suggest_int("samples", 1200, 6000, step=400),
        "first_physics": trial.suggest_float("first_physics", 0.3, 10.0, log=True),
        "last_physics": trial.suggest_float("last_physics", 10.0, 300.0, log=True),
        "steps": trial.suggest_int("steps", 60, 300, step=20),
    }


def _suggest_paper(trial: Trial) -> dict[str, Any]:
    return {
        "width": trial.suggest_int("width", 16, 128, step=16),
        "layers": trial.suggest_int("layers", 2, 5),
        "phi_data": trial.suggest_float("phi_data", 1e-2, 1e2, log=True),
        "phi_phys": trial.suggest_float("phi_phys", 1e-3, 1e2, log=True),
        "learning_rate": trial.suggest_float("learning_rate", 1e-4, 1e-2, log=True),
        "samples": trial.suggest_int("samples", 256, 4096, log=True),
    }


_SUGGESTIONS: dict[str, Callable[[Trial], dict[str, Any]]] = {
    "elements": _suggest_elements,
    "dense": _suggest_dense,
    "paper": _suggest_paper,
}
