"""Content of an effect file that tests change."""

import copy

import pytest

CONTENT = {
    "schema": "mrbench.effect/1",
    "name": "rising_friction",
    "meaning": "friction that grows with the drive",
    "stage": "damper",
    "place": "parallel_force",
    "kind": "value",
    "variables": ["velocity", "drive"],
    "expression": "(base + rise * drive) * tanh(velocity / width)",
    "parameters": {
        "base": {"value": 8.0, "unit": "N", "lo": 0.0, "hi": 80.0},
        "rise": {"value": 0.0, "unit": "N/{drive}", "lo": -20.0, "hi": 40.0},
        "width": {"value": 0.004, "unit": "m/s", "lo": 0.0005, "hi": 0.05},
    },
    "curve": None,
    "source": "",
}


@pytest.fixture
def content():
    """Return the content of a valid file; a test may change it."""
    return copy.deepcopy(CONTENT)


@pytest.fixture
def curve_content():
    """Return the content of a valid file with a curve alone."""
    return {
        "schema": "mrbench.effect/1",
        "name": "measured_friction",
        "stage": "damper",
        "place": "parallel_force",
        "kind": "value",
        "variables": ["velocity"],
        "curve": {
            "variable": "velocity",
            "unit": "N",
            "x": [-0.1, 0.0, 0.2],
            "value": [-5.0, 1.0, 9.0],
            "lo": [-6.0, 0.5, 8.0],
            "hi": [-4.0, 1.5, 10.0],
        },
    }
