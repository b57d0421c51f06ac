"""Comparison of starts."""

from types import SimpleNamespace

import pytest

from identification.pinn.common.result import TrainingRecord
from identification.pinn.elements import multistart


def test_the_oscillation_is_the_change_of_the_misfit_on_the_last_mesh_of_a_phase():
    def record(phase, force):
        return TrainingRecord(0.0, phase, force, 0.0, 0.0)

    last = SimpleNamespace(phase="last", history=[record("first", 9.0), record("last", 4.0), record("last", 3.9)])
    assert multistart._measure_oscillation(last) == pytest.approx(0.025)
    alone = SimpleNamespace(phase="last", history=[record("first", 9.0), record("last", 4.0)])
    assert multistart._measure_oscillation(alone) == 0.0
