"""Sequences of drawn requests: later ones use ids of earlier answers, and every answer is as described.

`MRBENCH_DRAWN_SEQUENCES` is the number of sequences. Schemathesis finds in the description which answers hold the
id that an operation takes. Each sequence begins on a service of its own, with three runs, a fit, a specimen, jobs
and a campaign.
"""

import itertools
import json
import os
from collections import Counter

import schemathesis
from schemathesis import Response

from tests.support.empty_catalogues import write_empty_catalogue
from tests.support.result_documents import fit_document
from tests.support.service_logs import write_complete_log
from tests.unit.bench.service.conftest import Service
from tests.unit.bench.service.test_schema import CHECKS, make_settings, read_description, send

DRAWN = int(os.environ.get("MRBENCH_DRAWN_SEQUENCES", "12"))
LENGTH = 10
"""Number of requests of a sequence."""
UPLOADS = "/api/v1/logs"
CAMPAIGN = {"name": "night", "steps": [{"prompt": {"text": "Mount"}}, {"rest": {"seconds": 100}}]}


def make_description():
    """Return the description without uploads."""
    document = read_description()
    del document["paths"][UPLOADS]
    return document


def prepare(service):
    """Record runs, identify one of them, and start a campaign."""
    for number in range(3):
        write_complete_log(service.data / f"{number}.mcap", run=f"run-{number}")
    service.start()
    service.scan()
    fitted = service.get("/jobs")["items"][0]
    service.complete(fitted, {"rmse_n": 2.0, "noise_floor_n": 1.9}, {"fit.json": json.dumps(fit_document())})
    service.post("/campaigns", {"campaign": CAMPAIGN, "operator": "M. Curie"}, status=201)


def test_answers_to_sequences_of_requests_are_as_described(tmp_path):
    answers, numbers = Counter(), itertools.count()

    class Sequence(schemathesis.openapi.from_dict(make_description()).as_state_machine()):
        def setup(self):
            folder = tmp_path / str(next(numbers))
            folder.mkdir()
            write_empty_catalogue(folder)
            self.service = Service(folder)
            prepare(self.service)

        def teardown(self):
            self.service.end()

        def call(self, case, **given):
            answer = send(self.service, case)
            answers[case.operation.label, answer.status_code] += 1
            return Response.from_any(answer)

        def validate_response(self, response, case, **given):
            case.validate_response(response, checks=CHECKS)

    Sequence.run(settings=make_settings(DRAWN, stateful_step_count=LENGTH))
    assert sum(answers.values()) > 4 * DRAWN
    # A drawn id is never known. How many known ids a set of sequences uses differs between processes.
    assert any("{" in label and status < 300 for label, status in answers), answers
