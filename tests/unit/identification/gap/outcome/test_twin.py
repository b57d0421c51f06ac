"""Delays and initial displacements of a twin, with their units."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting import COORDINATE_COUNT
from identification.gap.outcome.twin import _make_nuisances


def test_delays_are_in_seconds_and_their_limit_in_microseconds():
    unknowns = np.zeros(COORDINATE_COUNT + 2)
    unknowns[COORDINATE_COUNT:] = 0.5, -2.0
    problem = SimpleNamespace(
        delay_limit=3.0, delay_prior=20e-6, pieces=[SimpleNamespace(name="a"), SimpleNamespace(name="b")],
        make_model=lambda unknowns, i: SimpleNamespace(y0=1e-3 * (i + 1)),
    )  # fmt: skip
    fit = SimpleNamespace(problem=problem, minimum=SimpleNamespace(unknowns=unknowns))
    nuisances = _make_nuisances(SimpleNamespace(fit=fit))
    assert nuisances.force_delay.value == pytest.approx(10e-6)
    assert nuisances.drive_delay.value == pytest.approx(-40e-6)
    assert nuisances.force_delay.prior_sd == 20e-6
    assert nuisances.force_delay.note == "limited to 60 µs; a larger delay counts as an effect"
    assert nuisances.y0 == {"a": 1e-3, "b": 2e-3}
