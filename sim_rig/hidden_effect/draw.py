"""Random draw of one effect for the laboratory damper.

The effect is one of the library, in the form that the blind trial has for it. That form is not the library's
own, so a diagnosis has to recognise the cause and cannot return the function that was played.
"""

import json
from typing import Any

import numpy as np

from sim_rig.effect_forms import FORMS, AlternativeForm
from sim_rig.hidden_effect.sizes import SIZE_RANGES
from sim_rig.scenario import Scenario, parse_scenario
from sim_rig.trial.cases import compute_measures, draw_value, draw_values

STROKE, DURATION = 0.01, 54.0
"""[m] largest amplitude and [s] duration of the six-drive sine method, to which the random values refer."""
_STREAM = 21
"""Number of the random stream, so that the draw shares no number with the noise of the same seed."""


def draw_scenario(seed: int) -> Scenario:
    """Return the default rig with a damper whose hidden effect follows from a seed.

    The form is drawn first, then its size and its other values, each log-uniform in its range. The same seed
    gives the same damper on every machine.

    Args:
        seed: 0 or more; it also seeds the noise of the sensors.
    """
    random = np.random.default_rng([seed, _STREAM])
    form = FORMS[str(random.choice(list(SIZE_RANGES)))]
    effect = {"name": form.effect, "form": form.form, "parameters": _draw_parameters(form, random)}
    document = {"schema": "mrbench.scenario/1", "damper": "laboratory", "alternative_effects": [effect]}
    return parse_scenario(json.dumps({**document, "seed": seed}), f"of the draw {seed}")


def _draw_parameters(form: AlternativeForm, random: np.random.Generator) -> dict[str, Any]:
    """Draw all parameters of a form; the first is its size."""
    size = draw_value(SIZE_RANGES[form.form], random)
    values = draw_values(form.form, random, compute_measures("small", DURATION, STROKE))
    return {**values, form.parameters[0].symbol: size}
