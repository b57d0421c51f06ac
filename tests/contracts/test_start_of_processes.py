"""Processes of the bench start without the packages that only draw or compute, which take seconds to load."""

import subprocess
import sys

import pytest

HEAVY = ("fpdf", "matplotlib", "numba", "scipy", "torch")
"""Packages that take up to a second each to load."""


@pytest.mark.parametrize("package", ["bench.service", "bench.jobs", "bench.agent", "bench.runs"])
def test_a_process_of_the_bench_starts_without_heavy_packages(package):
    code = f"import sys, {package}; print([name for name in {HEAVY} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
