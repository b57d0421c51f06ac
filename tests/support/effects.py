"""Medium sizes of all forms of all effects, and a stroke on which each of them changes the force."""

import numpy as np

from identification.damper.coordinates import to_coordinates
from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import find_parameter_set
from identification.simulate import ActiveEffect, Excitation

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
RATE = 1000.0

_CHOSEN: dict[str, dict[str, tuple[float, ...]]] = {
    "field_saturation": {"tanh": (1.5,), "knee": (1.8, 3.0), "magnetisation": (1.2, 0.4, 0.2)},
    "magnetic_remanence": {
        "exponential": (0.03, 0.1, 1.0),
        "closing": (0.03, 0.1, 0.3, 1.0),
        "play_operator": (0.03, 1.0),
        "prandtl_ishlinskii": (0.4, 0.15, 1.0, 1.0),
    },
    "coil_lag": {
        "second_lag": (0.008,),
        "dead_time": (0.0061,),
        "dead_time_and_lag": (0.0047, 0.006),
        "partial_lag": (0.03, 0.4),
        "two_layer_lag": (0.02, 0.4),
    },
    "gas_spring": {
        "polytropic": (90.0, 0.05),
        "polytropic_reversed": (90.0, 0.05),
        "heat_exchange": (90.0, 0.05, 0.3),
        "heat_exchange_reversed": (90.0, 0.05, 0.3),
    },
    "seal_friction": {
        "stribeck": (20.0, 10.0, 0.015),
        "stribeck_exponential": (20.0, 10.0, 0.015),
        "presliding": (20.0, 10.0, 0.015, 6e-5),
        "bristle": (20.0, 0.5, 0.015, 6e-5),
    },
    "orifice_turbulence": {"quadratic": (1500.0,), "power": (15.0, 1.7)},
    "direction_asymmetry": {"proportional": (0.08, 0.15, 0.012), "one_sided": (120.0, 8.0, 0.01)},
    "viscous_heating": {"viscosity_only": (2e-3, 40.0), "uniform": (5e-4, 40.0), "partial": (1e-3, 40.0, 0.4)},
    "end_stop": {
        "both_ends": (2e4, 0.01, 1e-3),
        "extended_end": (2e4, 0.01, 1e-3),
        "compressed_end": (2e4, 0.01, 1e-3),
    },
    "clevis_backlash": {"backlash": (2e-4,), "free_pin": (1e-4, 2e-4), "greased_pin": (2e-4, 1e-4, 5e3)},
    "fixture_compliance": {"linear": (1e-6,), "stiffening": (1e-6, 3e6), "closing_joint": (1e-6, 100.0, 2.5)},
    "moving_mass": {"rigid": (4.0,)},
    "force_delay": {"pure_delay": (0.0021,)},
    "force_drift": {
        "settling": (12.0, 20.0),
        "sinusoidal": (8.0, -4.0, 60.0, 100.0),
        "harmonic": (8.0, -4.0, 3.0, 2.0, -2.0, 1.0, 1.0, -1.0, 0.5, 1.0, -0.5, 0.5, 70.0, 100.0),
    },
    "mains_hum": {"fundamental": (4.0, 3.0, 50.02), "third_harmonic": (4.0, 3.0, 1.0, -2.0, 50.02)},
    "displacement_nonlinearity": {
        "saturating": (1.5e-4, -2e-4, 0.012),
        "polynomial": (3e-5, 5e-5),
        "periodic": (4e-5, -6e-5, 0.018),
    },
    "force_filter": {"first_order": (0.003,)},
    "displacement_delay": {"pure_delay": (0.0017,)},
    "shear_thinning": {"proportional": (0.3, 0.08)},
    "side_load_friction": {"linear": (2000.0, 0.001), "bristle": (2000.0, 0.001, 0.5, 0.015, 6e-5)},
    "coil_crosstalk": {"proportional": (20.0,)},
}

MEDIUM = {
    effect.name: {
        form.name: _CHOSEN.get(effect.name, {}).get(form.name, tuple(q.scale for q in form.parameters))
        for form in effect.forms
    }
    for effect in EFFECTS.values()
}
"""Values of every form; the scales of its parameters where none are chosen above."""
FORMS = [(effect.name, form.name) for effect in EFFECTS.values() for form in effect.forms]
IDS = [f"{name}-{form}" for name, form in FORMS]


def active(name: str, form: str | None = None) -> ActiveEffect:
    """Return an effect at its medium size."""
    form = form or EFFECTS[name].forms[0].name
    return ActiveEffect(EFFECTS[name], MEDIUM[name][form], form)


def sine(amplitude: float = 0.015, frequency: float = 2.5, seconds: float = 2.0) -> Excitation:
    """Return a sine at several drives, with the power that a damper of this size dissipates."""
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * frequency
    drive = np.array([0.0, 0.3, 0.1, 0.5, 0.2])[(t / 0.41).astype(int) % 5]
    x, v, a = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t)
    power = (200.0 + 600.0 * drive) * np.abs(v)
    return Excitation(RATE, x, v, a, drive, start=3.0, power=power)
