"""One closing line for several test runs: ``python -m tests.summary RESULTS.xml... [--deselected FILE]``.

Each file holds the results of one run in JUnit format. A test that ran in several of them counts with its last
result. One that passed only when it was repeated alone is named, because it may depend on the load of the machine.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree


def main() -> int:
    """Print the line; exit status 1 where a test failed or was skipped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", nargs="+", type=Path)
    parser.add_argument("--deselected", type=Path, help="test ids that the runs left out, one a line")
    options = parser.parse_args()
    outcomes, repeated, seconds = read_outcomes(options.results)
    left_out = read_deselected(options.deselected)
    if left_out:
        print("left out (run them with `pytest -m slow`):", *left_out, sep="\n  ")
    counts = Counter(outcomes.values())
    if repeated:
        print("passed only when repeated alone:", *repeated, sep="\n  ")
    bad = [name for name, outcome in sorted(outcomes.items()) if outcome != "passed"]
    if bad:
        print("not passed:", *(f"{name}: {outcomes[name]}" for name in bad), sep="\n  ")
    parts = [f"{counts[name]} {name}" for name in ("failed", "passed", "skipped")]
    print(f"==== {', '.join(parts)}, {len(left_out)} deselected in {seconds:.2f}s ====")
    return int(bool(bad) or not outcomes)


def read_outcomes(paths: list[Path]) -> tuple[dict[str, str], list[str], float]:
    """Outcome of every test by its name, tests that passed only later, and the duration [s] of all runs."""
    outcomes: dict[str, str] = {}
    repeated = []
    seconds = 0.0
    for path in paths:
        for suite in ElementTree.parse(path).iter("testsuite"):
            seconds += float(suite.get("time", 0.0))
            for case in suite.iter("testcase"):
                name, outcome = f"{case.get('classname')}::{case.get('name')}", outcome_of(case)
                if outcome == "passed" and outcomes.get(name) == "failed":
                    repeated.append(name)
                outcomes[name] = outcome
    return outcomes, repeated, seconds


def outcome_of(case: ElementTree.Element) -> str:
    """One of passed, failed and skipped."""
    if case.find("failure") is not None or case.find("error") is not None:
        return "failed"
    return "skipped" if case.find("skipped") is not None else "passed"


def read_deselected(path: Path | None) -> list[str]:
    """Test ids of a ``pytest --collect-only -q`` listing."""
    lines = path.read_text(encoding="utf-8").splitlines() if path else []
    return [line for line in lines if "::" in line]


if __name__ == "__main__":
    sys.exit(main())
