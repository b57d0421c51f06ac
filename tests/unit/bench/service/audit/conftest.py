"""Service with a recorded run."""

import pytest

from tests.support.service_logs import write_complete_log


@pytest.fixture
def run(service, client):
    write_complete_log(service.data / "one.mcap", "run-1")
    service.scan()
    return "run-1"
