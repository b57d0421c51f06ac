"""Forces of every alternative form, as the plant computed them before its evaluation was made faster.

``reference_forces.json`` contains drawn parameters, and every 500th force of the stroke below [N].
"""

import json
from pathlib import Path

import numpy as np
import pytest

from sim_rig.effect_forms import FORMS
from sim_rig.plant.alternative_plant import make_plant
from sim_rig.scenario.scenario import parse_scenario

REFERENCE = json.loads(Path(__file__).with_name("reference_forces.json").read_text())
BALANCE = 1e-6
"""[N] Difference up to which the plant takes the forces of damper and mounting as equal."""


def test_every_form_has_reference_forces():
    assert set(REFERENCE) == set(FORMS)


@pytest.mark.parametrize("name", FORMS)
def test_the_forces_of_a_form_are_those_of_the_reference(name):
    effect = {"name": FORMS[name].effect, "form": name, "parameters": REFERENCE[name]["parameters"]}
    document = {"schema": "mrbench.scenario/1", "damper": "laboratory", "alternative_effects": [effect]}
    time = np.arange(601) * 1e-3
    command, drive = 0.006 * np.sin(6 * np.pi * time), np.where(time[:-1] < 0.3, 0.1, 0.4)
    truth = make_plant(parse_scenario(json.dumps(document), "of a test")).simulate(1e-3, command, drive)
    expected = REFERENCE[name]["force_n"]
    assert len(expected) == 10
    assert truth.force[299::500] == pytest.approx(expected, rel=1e-9, abs=BALANCE)
