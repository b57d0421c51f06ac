"""Three dampers of different size, each a little other than any that ships, and how hard each may be driven."""

from typing import Any, NamedTuple

import numpy as np

from identification.damper.coordinates import Coordinates, to_coordinates, to_parameters
from identification.damper.parameter_sets import PARAMETER_SETS

SPREAD = 0.15
"""[1] standard deviation of the logarithm by which each coordinate is other than the set's."""


class Size(NamedTuple):
    """What a damper of this size stands."""

    base: Coordinates
    """Before the spread."""
    drive_kind: str
    drive: float
    """[V or A] largest drive."""
    stroke: float
    """[m] largest amplitude."""
    force: float
    """[N] about what it gives at the largest drive."""
    noise: float
    """[N] of a load cell of its range."""


_LABORATORY = to_coordinates(PARAMETER_SETS["laboratory"].parameters)
_WORKSHOP = _LABORATORY._replace(
    F_a=110.0, F_b=1500.0, D_y=80e-6, rho=0.45, eta=55.0, c0_a=1500.0, c0_b=2600.0, c1_a=45e3, c1_b=60e3, k1=2500.0
)
_LORD_CLASS = to_coordinates(PARAMETER_SETS["lord_class"].parameters)

_REACH = 2.5
"""Times the damper's force that the actuator can push: over the wires a weaker one lags and trips."""

SIZES: dict[str, Size] = {
    "small": Size(_LABORATORY, "coil_v", 0.5, 0.011, 600.0, 2.5),
    "middle": Size(_WORKSHOP, "coil_v", 0.8, 0.014, 1600.0, 4.0),
    "large": Size(_LORD_CLASS, "coil_a", 1.0, 0.02, 2400.0, 6.0),
}
"""By name."""


def specimen(size: str, seed: int) -> dict[str, float]:
    """The paper's fourteen parameters of this trial's damper of a size."""
    base = SIZES[size].base
    chance = np.random.default_rng([seed, 11, list(SIZES).index(size)])
    factors = np.exp(SPREAD * np.clip(chance.standard_normal(len(base)), -2, 2))
    varied = Coordinates(*(float(value * factor) for value, factor in zip(base, factors, strict=True)))
    rho = min(max(varied.rho, 0.25), 0.8)
    return to_parameters(varied._replace(rho=rho, n=max(varied.n, 1.3)))._asdict()


def scenario_document(size: str, parameters: dict[str, float], **more: Any) -> dict[str, Any]:
    """A scenario with this damper, as a document."""
    kind = SIZES[size].drive_kind
    return {
        "schema": "mrbench.scenario/1",
        "damper": parameters,
        "drive_kind": kind,
        "drive_unit": "A" if kind == "coil_a" else "V",
        "specimen": {"serial": f"T-{size}", "model": "damper of a blind trial"},
        "actuator": {"force": _REACH * SIZES[size].force},
        **more,
    }
