"""Fixtures that several packages of tests share."""

import pytest


@pytest.fixture(scope="session")
def fit():
    """Fit of two recordings of the laboratory damper, with one segment held out."""
    # Inside the fixture: other tests must not wait for the simulation of the recordings.
    from identification.fitting.dataset import HoldOut
    from identification.pipeline import FitRequest, identify
    from tests.support.laboratory import FAST, SLOW, recording

    return identify([recording(SLOW, FAST)], FitRequest(HoldOut(("fast_0.5V",))))
