import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sim_rig.offline_run import CommandSeries
from sim_rig.scenario.scenario import Scenario, load_scenario, parse_scenario


@pytest.fixture(scope="session")
def varied() -> Callable[..., Scenario]:
    """Return a shipped scenario with some of its fields replaced."""

    def make(name: str = "ideal", **changes: Any) -> Scenario:
        document = load_scenario(name).model_dump(mode="json", by_alias=True)
        return parse_scenario(json.dumps({**document, **changes}), "of a test")

    return make


@pytest.fixture(scope="session")
def strokes() -> CommandSeries:
    """Three seconds of a 10 mm stroke at 2 Hz, the drive stepping from 0.1 to 0.4 V half way."""
    time = np.arange(3000) * 1e-3
    return CommandSeries(time, 0.01 * np.sin(4 * np.pi * time), np.where(time < 1.5, 0.1, 0.4))
