"""Error descriptions of all REST paths, and imports of the service."""

import subprocess
import sys

from bench.service.application import PUBLIC_OPERATIONS, create_app

HEAVY = ("torch", "numba", "identification.pipeline.identification", "sim_rig")


def test_every_path_describes_its_errors_and_needs_the_token():
    for path, methods in create_app().openapi()["paths"].items():
        for verb, method in methods.items():
            if f"{verb.upper()} {path}" not in PUBLIC_OPERATIONS:
                assert method["security"] == [{"HTTPBearer": []}], path
                assert "application/problem+json" in method["responses"]["422"]["content"], path


def test_the_service_imports_no_heavy_package():
    code = (
        f"import sys, bench.service.serving, bench.jobs.worker; print([m for m in {HEAVY!r} if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "[]"
