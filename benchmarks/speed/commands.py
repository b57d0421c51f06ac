"""Speed and memory of the commands: processor time and peak memory of whole processes, imports included.

Logs are those of the simulated plant at 1 kHz: one minute, ten minutes, and two minutes with or without an effect.
Each command runs twice, and the second run counts, because the first one compiles and fills the caches. Times are
also given over a baseline of the same run: a process that only loads numba and scipy.signal. ``--before CHECKOUT``
runs every command of an earlier version as well, in turn with the present one. ``--keep FOLDER`` keeps logs and
results and continues an interrupted call; ``--only report,diagnose`` selects commands.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.common import (
    NO_EFFECT,
    lengthen_method,
    load_results,
    make_parser,
    open_folder,
    record_effect,
    select_names,
)

_CHECKOUT = Path(__file__).parents[2]
_EVIDENCE = _CHECKOUT / "docs" / "evidence"
_EFFECT = "gas_spring"
"""Effect that the diagnosis has to find."""
_LOGS = {
    "one_minute": ("six_voltages", 1, NO_EFFECT),
    "ten_minutes": ("six_voltages", 11, NO_EFFECT),
    "two_minutes": ("quick", 6, NO_EFFECT),
    "two_minutes_effect": ("quick", 6, _EFFECT),
}
"""Method, factor on its cycles, and effect of each log."""
_BASELINE = ("-c", "import numba, scipy.signal")
_LAUNCHER = """
import resource, subprocess, sys
code = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(code)
"""
"""Small process that starts a command: the peak memory of a new process includes that of its parent."""
_PAGE = """# Speed of the commands

Processor time (user and system) and peak memory of whole processes, imports included, with warm caches. The logs
are those of the simulated plant at 1 kHz: `six_voltages` for one minute, eleven times its cycles for ten, and
`quick` six times as long for two. Each command runs twice and the second run counts. The baseline is a process
that only loads numba and scipy.signal. Processor seconds grow on a shared machine, so ratios count. Command:

```
python -m benchmarks.speed.commands --keep FOLDER --before CHECKOUT --page
```

Baseline: {baseline:.2f} s{before}.

| command | before, CPU s | now, CPU s | now / before | now / baseline | before, MB | now, MB | limit | |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- | --- |
{rows}

A report with a fit predicts the force in a second process, which loads the packages of the baseline again. Memory
is that of the largest process. The fit of ten minutes simulates the force at 4 kHz, because the force channel has
a filter. Its sensitivities alone are 16 numbers for each of 2.3 million samples, 290 MB.

Not measured: {missing}.
"""


class Case(NamedTuple):
    """One command, and the limits that it should keep."""

    words: tuple[str, ...]
    """Command line; names of logs and documents are relative to the folder."""
    seconds: float
    """Limit of the processor time [s]."""
    memory: float = 0.0
    """Limit of the peak memory [MB]; 0 for none."""


CASES = {
    "identify_refine": Case(("identify", "one_minute.mcap", "--stages", "refine", "--out", "fit.json"), 3.0),
    "identify": Case(("identify", "one_minute.mcap", "--out", "both.json"), 12.0),
    "report_log": Case(("report", "one_minute.mcap", "--out", "log.html"), 2.0),
    "report_fit": Case(("report", "one_minute.mcap", "--fit", "fit.json", "--out", "fit.html"), 2.0),
    "identify_long": Case(
        ("identify", "ten_minutes.mcap", "--stages", "refine", "--out", "long.json"), 15.0, 800.0
    ),
    "diagnose_nothing": Case(("diagnose", "two_minutes.mcap", "--out", "nothing.json"), 3.0),
    "diagnose": Case(("diagnose", "two_minutes_effect.mcap", "--out", "effect.json"), 30.0),
    "discover": Case(("diagnose", "two_minutes_effect.mcap", "--discover", "--out", "discover.json"), 180.0),
}
"""Commands by name, in an order in which a document is made before it is read."""


class Usage(NamedTuple):
    """Use of the machine by one process and its children."""

    seconds: float
    """Processor time [s]."""
    memory: float
    """Peak resident memory of the largest process [MB]."""


def measure_process(words: Sequence[str], folder: Path, checkout: Path) -> Usage:
    """Run Python in a folder with the packages of a checkout, and return what it used.

    Raises:
        RuntimeError: the process failed.
    """
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    command = [sys.executable, "-I", "-S", "-c", _LAUNCHER, sys.executable, *words]
    result = subprocess.run(
        command, cwd=folder, env=environment, check=False, text=True, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    if result.returncode != 0:
        raise RuntimeError(f"python {' '.join(words)}: exit status {result.returncode}")
    seconds, kibibytes = result.stdout.splitlines()[-1].split()
    return Usage(float(seconds), float(kibibytes) * 1024 / 1e6)


def measure_command(name: str, folder: Path, checkout: Path) -> Usage:
    """Return what the second run of a command used."""
    words = ("-m", "bench.cli", *CASES[name].words)
    measure_process(words, folder, checkout)
    return measure_process(words, folder, checkout)


def _load_usage(name: str, folder: Path, checkout: Path, version: str) -> Usage:
    found: Any = load_results(
        folder / f"{name}.{version}.usage.json", lambda: measure_command(name, folder, checkout)
    )
    return Usage(*found)


def _make_logs(folder: Path) -> None:
    for name, (method, times, effect) in _LOGS.items():
        record_effect(lengthen_method(method, times), effect, 1.0, 1, folder / f"{name}.mcap")


def _measure_baseline(folder: Path, checkout: Path) -> float:
    return min(measure_process(_BASELINE, folder, checkout).seconds for _ in range(3))


def render_row(name: str, now: Usage, before: Usage | None, baseline: float) -> str:
    """Return one row of the page's table."""
    case = CASES[name]
    met = now.seconds <= case.seconds and (not case.memory or now.memory <= case.memory)
    limit = f"{case.seconds:g} s" + (f", {case.memory:g} MB" if case.memory else "")
    cells = [
        f"`{' '.join(('mrbench', *case.words))}`",
        f"{before.seconds:.1f}" if before else "–",
        f"{now.seconds:.1f}",
        f"{now.seconds / before.seconds:.2f}" if before else "–",
        f"{now.seconds / baseline:.1f}",
        f"{before.memory:.0f}" if before else "–",
        f"{now.memory:.0f}",
        limit,
        "met" if met else "missed",
    ]
    return f"| {' | '.join(cells)} |"


def render_page(rows: dict[str, str], baseline: float, version: str) -> str:
    """Return the page of all measurements.

    Args:
        rows: rows of the table by name.
        baseline: processor time of the baseline [s].
        version: commit of the earlier version; empty without one.
    """
    return _PAGE.format(
        baseline=baseline,
        before=f"; before: commit {version}" if version else "",
        rows="\n".join(rows.values()),
        missing=", ".join(f"`{name}`" for name in CASES if name not in rows) or "none",
    )


def measure(folder: Path, names: Sequence[str], before: Path | None = None) -> tuple[dict[str, str], float]:
    """Measure commands, print their rows, and return them with the baseline [s]."""
    _make_logs(folder)
    baseline, rows = _measure_baseline(folder, _CHECKOUT), dict[str, str]()
    print(f"baseline: {baseline:.2f} s")
    for name in names:
        earlier = _load_usage(name, folder, before, "before") if before else None
        rows[name] = render_row(name, _load_usage(name, folder, _CHECKOUT, "now"), earlier, baseline)
        print(rows[name], flush=True)
    return rows, baseline


def run() -> None:
    """Measure all commands in a temporary folder."""
    with open_folder(None) as folder:
        measure(folder, list(CASES))


def main() -> None:
    """Measure, print the table, and write the page on request."""
    asked = _make_parser().parse_args()
    with open_folder(asked.keep) as folder:
        rows, baseline = measure(folder.resolve(), select_names(asked.only, list(CASES)), asked.before)
    if asked.page:
        page = render_page(rows, baseline, asked.version)
        (_EVIDENCE / "speed-of-commands.md").write_text(page, encoding="utf-8")


def _make_parser() -> argparse.ArgumentParser:
    parser = make_parser(__doc__, "logs and results")
    parser.add_argument("--before", type=Path, default=None, help="checkout of an earlier version")
    parser.add_argument("--version", default="", help="name of that version on the page")
    parser.add_argument("--page", action="store_true", help="write the page")
    return parser


if __name__ == "__main__":
    main()
