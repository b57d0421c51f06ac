"""All REST operations with drawn requests: answers agree with the description, and none is an internal error.

`MRBENCH_DRAWN_REQUESTS` is the number of requests for each operation and mode. Uploads (`POST /logs`) are left
out: their body is a stream of files, which is tested with uploads. So is the token, which has tests of its own.
"""

import os

import hypothesis
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from bench.service.application import create_app
from tests.support.logs import write_log

DRAWN = int(os.environ.get("MRBENCH_DRAWN_REQUESTS", "4"))
CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    negative_data_rejection,
]
OWN_HEADERS = ("authorization", "user-agent", "accept-encoding")
UPLOAD = "POST /api/v1/logs"


def read_description():
    """Return the description without the token, which is sent with every request."""
    document = create_app().openapi()
    for path in document["paths"].values():
        for operation in path.values():
            operation.pop("security", None)
    return document


def make_settings(drawn, **more):
    """Return settings that draw the same examples each time."""
    return settings(
        max_examples=drawn,
        deadline=None,
        database=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
        **more,
    )


@pytest.fixture(scope="module")
def operations():
    """Return the operations; in a fixture, so that only the process that needs them reads the description."""
    document = read_description()
    found = [result.ok() for result in schemathesis.openapi.from_dict(document).get_all_operations()]
    return [operation for operation in found if operation.label != UPLOAD]


@pytest.fixture
def service(service):
    """Return a service with one recorded run."""
    write_log(service.data / "one.mcap")
    service.scan()
    return service


def send(service, case):
    request = case.as_transport_kwargs(base_url=str(service.client.base_url))
    request.pop("cookies", None)
    headers = {name: value for name, value in request.pop("headers").items() if name.lower() not in OWN_HEADERS}
    body = {"content": request.pop("data")} if "data" in request else {}
    return service.client.request(headers=headers, **request, **body)


def check(service, operation, mode):
    @make_settings(DRAWN)
    @hypothesis.given(case=operation.as_strategy(generation_mode=mode))
    def check_case(case):
        case.validate_response(send(service, case), checks=CHECKS)

    check_case()


@pytest.mark.parametrize(("mode", "least"), [(GenerationMode.POSITIVE, 60), (GenerationMode.NEGATIVE, 25)])
def test_drawn_requests_get_described_answers(service, operations, mode, least):
    # Without query and body, an operation takes any text in its path: no request is invalid.
    chosen = [one for one in operations if mode is GenerationMode.POSITIVE or one.query or one.body]
    assert len(chosen) >= least
    for operation in chosen:
        check(service, operation, mode)
