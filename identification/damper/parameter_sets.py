"""Dampers that ship with mrbench, by name."""

import warnings
from typing import NamedTuple

from identification.damper.coordinates import Coordinates, to_coordinates, to_parameters
from identification.damper.parameters import Parameters


class ParameterSet(NamedTuple):
    """Damper with its source and its range of drives."""

    parameters: Parameters
    """The fourteen parameters, in SI units."""
    drive_unit: str
    """``V`` or ``A``."""
    drive_max: float
    """Largest drive for which the set is intended [V or A]."""
    source: str
    """Source of the values."""
    warning: str = ""
    """Reason why the set does not describe a damper; empty where it does."""


_LABORATORY = Coordinates(
    F_a=45.0,
    F_b=900.0,
    D_y=30e-6,
    rho=0.55,
    n=2.0,
    eta=80.0,
    c0_a=700.0,
    c0_b=2200.0,
    c1_a=18e3,
    c1_b=26e3,
    k0=2200.0,
    k1=800.0,
    f0=16.0,
)
_LORD_CLASS = Coordinates(
    F_a=60.0,
    F_b=1900.0,
    D_y=180e-6,
    rho=0.5,
    n=1.8,
    eta=60.0,
    c0_a=900.0,
    c0_b=1600.0,
    c1_a=30e3,
    c1_b=60e3,
    k0=2500.0,
    k1=1200.0,
    f0=90.0,
)

PARAMETER_SETS: dict[str, ParameterSet] = {
    "laboratory": ParameterSet(
        to_parameters(_LABORATORY), "V", 0.5, "small laboratory damper, the default of demo and tests"
    ),
    "lord_class": ParameterSet(
        to_parameters(_LORD_CLASS),
        "A",
        1.0,
        "current-driven damper of the Lord class: 5 ohm, 1 A continuous, 2 A for a short time, 74 mm stroke, "
        "about 2.4 kN at 1 A; values from trade knowledge, not from a data sheet",
    ),
    "spencer_1997": ParameterSet(
        Parameters(
            alpha_a=14000.0,
            alpha_b=69500.0,
            beta=3.63e6,
            gamma=3.63e6,
            eta=190.0,
            A=301.0,
            c0_a=2100.0,
            c0_b=350.0,
            c1_a=28300.0,
            c1_b=295.0,
            k0=4690.0,
            k1=500.0,
            n=2.0,
            x0=0.143,
        ),
        "V",
        2.25,
        "Spencer, Dyke, Sain and Carlson, J. Eng. Mech. 123 (1997) 230, converted to SI",
    ),
    "paper_table_1": ParameterSet(
        Parameters(
            alpha_a=1.921141e3,
            alpha_b=5.88251e3,
            beta=3.633207e4,
            gamma=3.633207e4,
            eta=60.0043108,
            A=155.32,
            c0_a=1.65073317e5,
            c0_b=-3.33399584e5,
            c1_a=77.34653,
            c1_b=2.4050407e4,
            k0=2.60786039e4,
            k1=172.270067,
            n=1.99999659,
            x0=0.0,
        ),
        "V",
        0.5,
        "Wu, Sicard, Kosierb and Gadsden, Table 1",
        "not a damper: c0 = c0_a + c0_b u is -1627 N s/m at 0.5 V (negative above 0.4951 V), and at 0 V "
        "it is about 2000 times c1, so a 10 mm stroke at 1 Hz causes 5 N. Use it only to study the paper",
    ),
}


def find_parameter_set(name: str) -> ParameterSet:
    """Return a shipped damper by its name.

    Raises:
        KeyError: there is no such set; the message lists those that exist.

    Warns:
        UserWarning: the set does not describe a damper; the text gives the reason.
    """
    try:
        parameter_set = PARAMETER_SETS[name]
    except KeyError:
        raise KeyError(f"no parameter set {name!r}; there are {', '.join(sorted(PARAMETER_SETS))}") from None
    if parameter_set.warning:
        warnings.warn(f"{name}: {parameter_set.warning}", UserWarning, stacklevel=2)
    return parameter_set


def check_drive_range(p: Parameters, lowest: float, highest: float) -> list[str]:
    """Return one sentence for each unphysical property of a set between two drives [V or A]."""
    c = to_coordinates(p)
    faults = []
    for name, unit, base, slope in (
        ("yield force", "N", c.F_a, c.F_b),
        ("c0", "N s/m", p.c0_a, p.c0_b),
        ("c1", "N s/m", p.c1_a, p.c1_b),
    ):
        # Linear in the drive: a value that is positive at both ends is positive between them.
        for drive in (lowest, highest):
            value = base + slope * drive
            if value < 0:
                faults.append(f"{name} is {value:.4g} {unit} at drive {drive:g}: the damper would generate energy")
    return faults
