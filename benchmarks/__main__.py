"""`python -m benchmarks [NAME...]`: run all benchmarks, or those named."""

import importlib
import sys

from benchmarks.common import measure_reference_time

NAMES = ("simulation", "fitting", "logs", "coverage", "soak")


def main() -> None:
    """Print every benchmark beside what is asked of it."""
    print(f"reference kernel (a million additions in plain Python): {measure_reference_time() * 1e3:.1f} ms")
    for name in sys.argv[1:] or NAMES:
        importlib.import_module(f"benchmarks.{name}").run()


main()
