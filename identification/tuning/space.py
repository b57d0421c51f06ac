"""What is varied of each network's settings, and how the values become settings."""

from collections.abc import Callable
from typing import Any

from optuna import Trial

from identification.pinn.settings import GROUPS, GlobalSettings, LocalSettings, PaperSettings

Settings = LocalSettings | GlobalSettings | PaperSettings

_LAYER, _LEVEL = ("units", "rank", "points"), ("physics", "meshes", "thin")
"""Of the local network: what is varied of the first hidden layer, and of the last level."""
_NOTHING = "nothing"
"""Is left out of the global network's inputs."""


def suggested(trial: Trial, preset: Settings) -> Settings:
    """Settings for a trial: what is varied as the study suggests, all else as in the preset."""
    chosen = _SUGGESTIONS[preset.network](trial)
    return settings_of(preset, chosen)


def settings_of(preset: Settings, chosen: dict[str, Any]) -> Settings:
    """A preset with chosen values."""
    match preset:
        case LocalSettings():
            return _local(preset, chosen)
        case GlobalSettings():
            return _global(preset, chosen)
        case PaperSettings():
            return preset.model_copy(update=chosen)


def values_of(preset: Settings) -> dict[str, Any]:
    """What a preset itself has of what is varied."""
    match preset:
        case LocalSettings(layers=(layer, *_), levels=(*_, level)):
            first = {name: getattr(layer, name) for name in _LAYER}
            last = {name: getattr(level, name) for name in _LEVEL}
            return first | last | preset.model_dump(include={"multipliers", "activation", "features"})
        case GlobalSettings(physics=(first_weight, last_weight)):
            left = next((name for name in GROUPS if name not in preset.features), _NOTHING)
            plain = preset.model_dump(include={"width", "layers", "samples", "steps"})
            return plain | {"first_physics": first_weight, "last_physics": last_weight, "without": left}
        case _:
            return preset.model_dump(
                include={"width", "layers", "phi_data", "phi_phys", "learning_rate", "samples"}
            )


def _local(preset: LocalSettings, chosen: dict[str, Any]) -> LocalSettings:
    size, *richer = preset.layers
    first = size.model_copy(update={name: chosen[name] for name in _LAYER})
    *early, last = preset.levels
    level = last.model_copy(update={name: chosen[name] for name in _LEVEL})
    plain = {name: value for name, value in chosen.items() if name not in _LAYER + _LEVEL}
    # A layer that is no richer than the first would bring nothing.
    layers = (first, *(layer for layer in richer if layer.rank > first.rank))
    return preset.model_copy(update=plain | {"layers": layers, "levels": (*early, level)})


def _global(preset: GlobalSettings, chosen: dict[str, Any]) -> GlobalSettings:
    plain = dict(chosen)
    weights = (plain.pop("first_physics"), plain.pop("last_physics"))
    left = plain.pop("without")
    features = tuple(name for name in GROUPS if name != left)
    return preset.model_copy(update=plain | {"physics": weights, "features": features})


def _suggest_local(trial: Trial) -> dict[str, Any]:
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


def _suggest_global(trial: Trial) -> dict[str, Any]:
    return {
        "width": trial.suggest_int("width", 10, 40, step=2),
        "layers": trial.suggest_int("layers", 1, 3),
        "without": trial.suggest_categorical("without", [_NOTHING, *GROUPS]),
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
    "local": _suggest_local,
    "global": _suggest_global,
    "paper": _suggest_paper,
}
