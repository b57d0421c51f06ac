"""Processes of the bench start without the packages that only draw or compute, which take seconds to load."""

import subprocess
import sys

import pytest

HEAVY = ("fpdf", "matplotlib", "numba", "scipy", "torch")
"""Packages that take up to a second each to load."""
FOREIGN = ("identification.pipeline.identification", "sim_rig")
"""Packages of which service and worker use files and commands only."""


@pytest.mark.parametrize(
    ("modules", "unwanted"),
    [
        ("bench.service, bench.service.serving", HEAVY + FOREIGN),
        ("bench.jobs, bench.jobs.worker", HEAVY + FOREIGN),
        ("bench.agent", HEAVY),
        ("bench.runs", HEAVY),
    ],
)
def test_a_process_of_the_bench_starts_without_heavy_packages(modules, unwanted):
    code = f"import sys, {modules}; print([name for name in {unwanted} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert found.stdout.strip() == "[]"
