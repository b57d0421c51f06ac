"""Damper that is assumed when planned strokes are assessed."""

from dataclasses import dataclass
from pathlib import Path

from identification.damper import PARAMETER_SETS, Coordinates, to_coordinates
from identification.documents import Fit
from identification.errors import IdentificationError
from identification.fitting import make_damper_model, read_fit_or_model

_DEFAULT_SETS = {"V": "laboratory", "A": "lord_class"}
"""Parameter set that is assumed without a model, by the drive's unit."""
_DEFAULT_NOISE = 2.5
"""Noise of a usual load cell [N]."""


@dataclass(frozen=True)
class AssumedDamper:
    """Assumed damper and noise."""

    name: str
    """Name of the parameter set or of the model's file."""
    coordinates: Coordinates
    noise: float
    """Standard deviation of the noise in the recorded force [N]."""


def load_assumed_damper(model: Path | None, drive_unit: str, noise: float | None) -> AssumedDamper:
    """Return the damper of a fit, twin or scenario, or a usual one.

    Args:
        model: file of a fit, twin or scenario; None for the usual damper of the drive's unit.
        drive_unit: V or A.
        noise: noise of the recorded force [N]; None takes the fit's noise floor, or that of a usual load cell.

    Raises:
        IdentificationError: the model cannot be read, or is driven in another unit.
    """
    if model is None:
        name = _DEFAULT_SETS[drive_unit]
        return AssumedDamper(name, to_coordinates(PARAMETER_SETS[name].parameters), noise or _DEFAULT_NOISE)
    fit_or_model = read_fit_or_model(model)
    if not isinstance(fit_or_model, Fit):
        return AssumedDamper(model.name, fit_or_model.coordinates, noise or _DEFAULT_NOISE)
    if fit_or_model.drive_unit != drive_unit:
        raise IdentificationError(
            f"{model}: the damper is driven in {fit_or_model.drive_unit}, the method in {drive_unit}; "
            "give another model"
        )
    return AssumedDamper(
        model.name, make_damper_model(fit_or_model).coordinates, noise or fit_or_model.noise_floor_n
    )
