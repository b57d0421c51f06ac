"""The REST interface is the one that is committed, and the service stays light."""

import json
import subprocess
import sys

from bench.service.describe import FILE, openapi_text

HEAVY = ("torch", "numba", "identification.identify", "sim_rig")


def test_the_committed_description_is_that_of_the_code():
    assert FILE.read_text("utf-8") == openapi_text(), "run: python -m bench.service.describe"


def test_every_path_tells_how_it_fails_and_asks_for_the_token():
    described = json.loads(openapi_text())
    for path, methods in described["paths"].items():
        for method in methods.values():
            if path != "/api/v1/health":
                assert method["security"] == [{"HTTPBearer": []}], path
                assert "application/problem+json" in method["responses"]["422"]["content"], path


def test_the_service_loads_nothing_heavy():
    words = (
        f"import sys, bench.service.serving, bench.jobs.worker; print([m for m in {HEAVY!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "[]"
