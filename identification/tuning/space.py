"""What is varied of each network's settings, and how the values become settings."""

from collections.abc import Callable
from typing import Any

from optuna import Trial

from identification.pinn.settings import GlobalSettings, LayerSize, LocalSettings, PaperSettings

Settings = LocalSettings | GlobalSettings | PaperSettings


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
            weights = (chosen["first_physics"], chosen["last_physics"])
            plain = {name: value for name, value in chosen.items() if not name.endswith("physics")}
            return preset.model_copy(update={**plain, "physics": weights})
        case PaperSettings():
            return preset.model_copy(update=chosen)


def _local(preset: LocalSettings, chosen: dict[str, Any]) -> LocalSettings:
    first = LayerSize(**{name: chosen[name] for name in ("units", "rank", "points")})
    *early, last = preset.levels
    level = last.model_copy(update={name: chosen[name] for name in ("physics", "meshes", "thin")})
    return preset.model_copy(
        update={
            "layers": (first, *preset.layers[1:]),
            "levels": (*early, level),
            "multipliers": chosen["multipliers"],
        }
    )


def _suggest_local(trial: Trial) -> dict[str, Any]:
    rank = trial.suggest_int("rank", 24, 64, step=4)
    return {
        "rank": rank,
        "units": trial.suggest_int("units", 80, 320, step=20),
        "points": trial.suggest_int("points", 60, 128, step=4),
        "physics": trial.suggest_float("physics", 5.0, 300.0, log=True),
        "meshes": trial.suggest_int("meshes", 2, 12),
        "thin": trial.suggest_int("thin", 1, 4),
        "multipliers": trial.suggest_int("multipliers", 0, 6),
    }


def _suggest_global(trial: Trial) -> dict[str, Any]:
    return {
        "width": trial.suggest_int("width", 10, 40, step=2),
        "samples": trial.suggest_int("samples", 1200, 6000, step=400),
        "first_physics": trial.suggest_float("first_physics", 0.3, 10.0, log=True),
        "last_physics": trial.suggest_float("last_physics", 10.0, 300.0, log=True),
        "steps": trial.suggest_int("steps", 60, 300, step=20),
    }


def _suggest_paper(trial: Trial) -> dict[str, Any]:
    return {
        "width": trial.suggest_int("width", 16, 128, step=16),
        "layers": trial.suggest_int("layers", 2, 5),
        "phi_phys": trial.suggest_float("phi_phys", 1e-3, 1e2, log=True),
        "learning_rate": trial.suggest_float("learning_rate", 1e-4, 1e-2, log=True),
        "samples": trial.suggest_int("samples", 256, 4096, log=True),
    }


_SUGGESTIONS: dict[str, Callable[[Trial], dict[str, Any]]] = {
    "local": _suggest_local,
    "global": _suggest_global,
    "paper": _suggest_paper,
}
