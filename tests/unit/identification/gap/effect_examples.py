"""A medium size of every form of every effect, and a stroke on which all of them show."""

import numpy as np

from identification.damper.coordinates import to_coordinates
from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import parameter_set
from identification.simulate import ActiveEffect, Stroke

LABORATORY = to_coordinates(parameter_set("laboratory").parameters)
RATE = 1000.0

MEDIUM: dict[str, dict[str, tuple[float, ...]]] = {
    "field_saturation": {"tanh": (1.5,), "knee": (1.8, 3.0), "magnetisation": (1.2, 0.4, 0.2)},
    "magnetic_remanence": {"exponential": (0.03, 0.1), "closing": (0.03, 0.1, 0.3), "play": (0.03,)},
    "coil_lag": {
        "second_lag": (0.008,),
        "dead_time": (0.0061,),
        "late_and_slow": (0.0047, 0.006),
        "partly_slow": (0.03, 0.4),
        "deeply_slow": (0.02, 0.4),
    },
    "gas_spring": {
        "polytropic": (90.0, 0.05),
        "polytropic_turned": (90.0, 0.05),
        "heat_to_wall": (90.0, 0.05, 0.3),
        "heat_to_wall_turned": (90.0, 0.05, 0.3),
    },
    "seal_friction": {
        "stribeck": (20.0, 10.0, 0.015),
        "stribeck_gentle": (20.0, 10.0, 0.015),
        "bending_lip": (20.0, 10.0, 0.015, 6e-5),
    },
    "orifice_turbulence": {"quadratic": (1500.0,), "power": (15.0, 1.7)},
    "direction_asymmetry": {"shares": (0.08, 0.15, 0.012), "one_way": (120.0, 8.0, 0.01)},
    "viscous_heating": {"viscosity": (2e-3, 40.0), "whole": (5e-4, 40.0), "partly": (1e-3, 40.0, 0.4)},
    "end_stop": {
        "both_ends": (2e4, 0.01, 1e-3),
        "extended_end": (2e4, 0.01, 1e-3),
        "compressed_end": (2e4, 0.01, 1e-3),
    },
    "clevis_backlash": {"play": (2e-4,), "free_pin": (1e-4, 2e-4), "greased_pin": (2e-4, 1e-4, 5e3)},
    "fixture_compliance": {"linear": (1e-6,), "stiffening": (1e-6, 3e6), "closing": (1e-6, 100.0, 2.5)},
    "moving_mass": {"rigid": (4.0,)},
    "force_delay": {"pure_delay": (0.0021,)},
    "force_drift": {
        "settling": (12.0, 20.0),
        "swinging": (8.0, -4.0, 60.0),
        "wandering": (8.0, -4.0, 3.0, 2.0, -2.0, 1.0, 1.0, -1.0, 0.5, 1.0, -0.5, 0.5, 70.0),
    },
    "mains_hum": {"line": (4.0, 3.0, 50.02), "with_third": (4.0, 3.0, 1.0, -2.0, 50.02)},
    "displacement_nonlinearity": {
        "bow_and_curve": (1.5e-4, -2e-4, 0.012),
        "powers": (3e-5, 5e-5),
        "wave": (4e-5, -6e-5, 0.018),
    },
    "force_filter": {"first_order": (0.003,)},
    "displacement_delay": {"pure_delay": (0.0017,)},
    "shear_thinning": {"shares": (0.3, 0.08)},
    "side_load_friction": {"linear": (2000.0, 0.001)},
    "coil_crosstalk": {"proportional": (20.0,)},
}

FORMS = [(effect.name, form.name) for effect in EFFECTS.values() for form in effect.forms]
IDS = [f"{name}-{form}" for name, form in FORMS]


def active(name: str, form: str | None = None) -> ActiveEffect:
    """An effect at its medium size."""
    form = form or EFFECTS[name].forms[0].name
    return ActiveEffect(EFFECTS[name], MEDIUM[name][form], form)


def sine(amplitude: float = 0.015, frequency: float = 2.5, seconds: float = 2.0) -> Stroke:
    """A sine across drives, with the power that a damper of this size dissipates in it."""
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * frequency
    drive = np.array([0.0, 0.3, 0.1, 0.5, 0.2])[(t / 0.41).astype(int) % 5]
    x, v, a = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t)
    power = (200.0 + 600.0 * drive) * np.abs(v)
    return Stroke(RATE, x, v, a, drive, start=3.0, power=power)
