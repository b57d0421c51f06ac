"""The damper that planned strokes are judged with."""

from pathlib import Path

from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.errors import IdentificationError
from identification.foresight.foresee import Assumed
from identification.gap.model import model_of_fit, read_fit_or_model
from identification.results import Fit

_USUAL = {"V": "laboratory", "A": "lord_class"}
"""Parameter set to expect where none is named, by the drive's unit."""
_NOISE = 2.5
"""[N] noise of a usual load cell."""


def assumed_damper(model: Path | None, drive_unit: str, noise: float | None) -> Assumed:
    """The damper of a fit, twin or scenario, or a usual one; the noise of a fit where none is named.

    Raises:
        IdentificationError: the model cannot be read, or is driven in another unit.
    """
    if model is None:
        name = _USUAL[drive_unit]
        return Assumed(name, to_coordinates(PARAMETER_SETS[name].parameters), noise or _NOISE)
    found = read_fit_or_model(model)
    if not isinstance(found, Fit):
        return Assumed(model.name, found.point, noise or _NOISE)
    if found.drive_unit != drive_unit:
        raise IdentificationError(
            f"{model}: the damper is driven in {found.drive_unit}, the method in {drive_unit}; give another model"
        )
    return Assumed(model.name, model_of_fit(found).point, noise or found.noise_floor_n)
