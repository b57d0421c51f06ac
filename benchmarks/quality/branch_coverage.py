"""Branch coverage of all tests, by top-level package.

    python -m benchmarks.quality.branch_coverage [--out PAGE.md]

Three runs are combined: all tests except those on wires, the wire tests, and the tests of the integrators with the
compiler switched off, since compiled code cannot be traced. Processes that tests start are counted. The data file
keeps which test ran each line; ``benchmarks.quality.planted_faults`` reads it.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "build" / "coverage"
DATA = FOLDER / "coverage"
PACKAGES = ("bench", "drivers", "identification", "sim_rig")
REQUIRED = 85.0
"""Least branch coverage of each top-level package [%]."""
INTERPRETED = (
    "tests/unit/identification/simulate",
    "tests/unit/identification/damper",
    "tests/unit/sim_rig/plant",
)
"""Tests of functions that are otherwise compiled."""
INTERPRETED_TIME = 120.0
"""Time [s] for each file of these tests."""
CONFIG = f"""[run]
branch = true
parallel = true
source = {", ".join(PACKAGES)}
data_file = {DATA}
patch = subprocess
concurrency = thread, multiprocessing
sigterm = true
relative_files = true
[report]
exclude_also =
    if TYPE_CHECKING:
    @overload
    raise NotImplementedError
    ^\\s*\\.\\.\\.$
"""


class Coverage(NamedTuple):
    """Lines and branches of one package."""

    package: str
    statements: int
    branches: int
    percent: float
    """Covered lines and branches together [%], as coverage.py defines it."""
    branch_percent: float
    """Covered branches [%]."""


def main() -> int:
    """Measure, print one line for each package; return exit status 1 if one is below the limit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="also write the table to a page")
    parser.add_argument("--report-only", action="store_true", help="use the data of the last measurement")
    options = parser.parse_args()
    if not options.report_only:
        measure()
    found = [read_package(package) for package in PACKAGES]
    table = format_table(found)
    print(table)
    if options.out:
        options.out.write_text(table + "\n", encoding="utf-8")
    return int(any(min(one.percent, one.branch_percent) < REQUIRED for one in found))


def measure() -> None:
    """Run all tests under coverage and combine the data."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for old in (*FOLDER.glob("coverage*"), *FOLDER.glob("interpreted_*")):
        old.unlink()
    config = FOLDER / "settings.ini"
    config.write_text(CONFIG, encoding="utf-8")
    cov = ("--cov", f"--cov-config={config}", "--cov-context=test", "--cov-report=", "-p", "no:cacheprovider")
    _run("pytest", "-n", "2", "-q", *cov)
    _run("pytest", "-m", "wire and not slow", "-q", "--cov-append", *cov)
    paths = sorted(path for folder in INTERPRETED for path in (ROOT / folder).glob("test_*.py"))
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda path: run_interpreted(path, cov), paths))
    parts = [*FOLDER.glob("coverage.*"), *FOLDER.glob("interpreted_*")]
    _run("coverage", "combine", "--append", f"--rcfile={config}", *map(str, parts))


def run_interpreted(path: Path, options: Sequence[str]) -> None:
    """Run the tests of a file without the compiler, at most for ``INTERPRETED_TIME``.

    A long test of an integrator repeats its first second many times. Coverage stores the data of each test as it
    ends.
    """
    print("$ without the compiler:", path.relative_to(ROOT), flush=True)
    command = [sys.executable, "-m", "pytest", "-q", *options, str(path)]
    # A data file of its own: at its start, a run erases the data of the runs that share its file.
    data = FOLDER / f"interpreted_{path.parent.name}_{path.stem}"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "COVERAGE_FILE": str(data)}
    with subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL) as process:
        try:
            process.wait(INTERPRETED_TIME)
        except subprocess.TimeoutExpired:
            # Not SIGTERM: its handler blocks if it interrupts the tracer, which holds the lock of the data.
            process.kill()


def _run(*words: str, **environment: str) -> None:
    """Run a tool of this environment; failing tests are shown and do not end the measurement."""
    print("$", *words, flush=True)
    subprocess.run([sys.executable, "-m", *words], cwd=ROOT, env=os.environ | environment, check=False)


def read_package(package: str) -> Coverage:
    """Read the coverage of one top-level package from the combined data."""
    out = FOLDER / f"{package}.json"
    _run("coverage", "json", "-q", f"--rcfile={FOLDER / 'settings.ini'}", f"--include={package}/*", "-o", str(out))
    totals = json.loads(out.read_text("utf-8"))["totals"]
    return Coverage(
        package,
        totals["num_statements"],
        totals["num_branches"],
        totals["percent_covered"],
        totals["percent_branches_covered"],
    )


def format_table(found: list[Coverage]) -> str:
    """Return the packages as a Markdown table."""
    rows = [
        f"| `{c.package}` | {c.statements} | {c.branches} | {c.percent:.1f} % | {c.branch_percent:.1f} % |"
        for c in found
    ]
    return "\n".join(
        [
            "| package | statements | branches | lines and branches | branches alone |",
            "| --- | --- | --- | --- | --- |",
            *rows,
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
