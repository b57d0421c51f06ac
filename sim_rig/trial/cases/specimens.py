"""Three dampers of different size, each different from the shipped ones, with the limits of their strokes."""

from typing import Any, NamedTuple

import numpy as np

from identification.damper import PARAMETER_SETS, Coordinates, to_coordinates, to_parameters

PARAMETER_SPREAD = 0.15
"""[1] standard deviation of the logarithm of each coordinate over that of the base."""


class DamperSize(NamedTuple):
    """Base coordinates and limits of a damper of one size."""

    base: Coordinates
    """Coordinates before the random spread."""
    drive_kind: str
    drive: float
    """[V or A] largest drive."""
    stroke: float
    """[m] largest amplitude."""
    force: float
    """[N] approximate force at the largest drive."""
    noise: float
    """[N] noise of a load cell of its range."""


_LABORATORY = to_coordinates(PARAMETER_SETS["laboratory"].parameters)
_WORKSHOP = _LABORATORY._replace(
    F_a=110.0, F_b=1500.0, D_y=80e-6, rho=0.45, eta=55.0, c0_a=1500.0, c0_b=2600.0, c1_a=45e3, c1_b=60e3, k1=2500.0
)
_LORD_CLASS = to_coordinates(PARAMETER_SETS["lord_class"].parameters)

_FORCE_MARGIN = 2.5
"""[1] actuator force over damper force: over the wires, a weaker actuator lags and trips."""

SIZES: dict[str, DamperSize] = {
    "small": DamperSize(_LABORATORY, "coil_v", 0.5, 0.011, 600.0, 2.5),
    "middle": DamperSize(_WORKSHOP, "coil_v", 0.8, 0.014, 1600.0, 4.0),
    "large": DamperSize(_LORD_CLASS, "coil_a", 1.0, 0.02, 2400.0, 6.0),
}
"""Damper sizes by name."""


def draw_specimen(size: str, seed: int) -> dict[str, float]:
    """Draw the paper's fourteen parameters of a trial's damper of a size."""
    base = SIZES[size].base
    random = np.random.default_rng([seed, 11, list(SIZES).index(size)])
    factors = np.exp(PARAMETER_SPREAD * np.clip(random.standard_normal(len(base)), -2, 2))
    varied = Coordinates(*(float(value * factor) for value, factor in zip(base, factors, strict=True)))
    rho = min(max(varied.rho, 0.25), 0.8)
    return to_parameters(varied._replace(rho=rho, n=max(varied.n, 1.3)))._asdict()


def make_scenario_document(size: str, parameters: dict[str, float], **more: Any) -> dict[str, Any]:
    """Return a scenario document with this damper."""
    kind = SIZES[size].drive_kind
    return {
        "schema": "mrbench.scenario/1",
        "damper": parameters,
        "drive_kind": kind,
        "drive_unit": "A" if kind == "coil_a" else "V",
        "specimen": {"serial": f"T-{size}", "model": "damper of a blind trial"},
        "actuator": {"force": _FORCE_MARGIN * SIZES[size].force},
        **more,
    }
