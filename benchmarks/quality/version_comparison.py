"""Comparison of the documents of two versions, number by number.

A refactoring must not change a result. ``make`` records and analyses twelve logs with one installed version:
five from the simulated plant, two given logs that were recorded over wires, recordings of two real dampers and
three withheld ones. ``compare`` compares the documents of two versions.

    python -m benchmarks.quality.version_comparison make FOLDER --mrbench COMMAND --shared SHARED --wires A,B
    python -m benchmarks.quality.version_comparison compare BEFORE AFTER

Numbers, truth values and identifiers must be equal. Times, versions, paths and sentences are not compared, and a
field that was renamed is compared under its new name (``RENAMED``).
"""

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from identification.damper.effects import rename_form, rename_parameters

IGNORED = re.compile(r"(^|\.)(seconds|version|versions|path|sha256|created|history)(\.|\[|$)|provenance\.logs")
"""Fields that hold times, versions and paths."""
RENAMED: dict[str, str] = {
    "each_log": "per_log", "how": "basis", "inside": "coverage", "witness": "cross_check", "agrees": "consistent",
    "said": "message", "local": "elements", "global": "dense",
}  # fmt: skip
"""Last part of a field's path, or an identifier: old name to new name."""
_IDENTIFIER = re.compile(r"[A-Za-z0-9_./-]+")
_PLANT_RUNS = {
    "plant_quick": ("quick", "default", 11),
    "plant_voltages": ("six_voltages", "gas_spring", 12),
    "plant_backlash": ("six_voltages", "clevis_backlash", 13),
    "plant_currents": ("six_currents", "lord_class", 14),
    "plant_multisine": ("multisine", "noisy", 15),
}
_BLIND_CASES = ("case03", "case11", "case22")


class Case(NamedTuple):
    """Log, and the strokes that are held out of its fit."""

    name: str
    hold_out: str = ""


def main() -> int:
    """Run one of the two commands; return exit status 1 if a number differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("make", help="record and analyse the twelve logs")
    make.add_argument("folder", type=Path)
    make.add_argument("--mrbench", required=True, help="command of the version")
    make.add_argument("--shared", type=Path, required=True, help="folder with data/ and blind/")
    make.add_argument("--wires", required=True, help="logs recorded over wires, separated by commas")
    make.add_argument("--jobs", type=int, default=2)
    compare = commands.add_parser("compare", help="compare the documents of two folders")
    compare.add_argument("before", type=Path)
    compare.add_argument("after", type=Path)
    options = parser.parse_args()
    if options.command == "make":
        return make_documents(options)
    return compare_documents(options.before, options.after)


def make_documents(options: argparse.Namespace) -> int:
    """Record or import the logs, then identify, predict and diagnose each."""
    options.folder.mkdir(parents=True, exist_ok=True)
    cases = list(_record(options))
    with ThreadPoolExecutor(options.jobs) as pool:
        for case, failures in zip(cases, pool.map(lambda c: _analyse(options, c), cases), strict=True):
            print(case.name, "; ".join(failures) or "done", flush=True)
    return 0


def _record(options: argparse.Namespace) -> Iterator[Case]:
    folder, shared = options.folder, options.shared
    for name, (method, scenario, seed) in _PLANT_RUNS.items():
        _run_mrbench(
            options, "run", method, "--scenario", scenario, "--seed", str(seed), "--out", folder / f"{name}.mcap"
        )
        yield Case(name)
    for number, log in enumerate(options.wires.split(","), 1):
        (folder / f"wires_{number}.mcap").write_bytes(Path(log).read_bytes())
        yield Case(f"wires_{number}")
    strokes = sorted((shared / "data" / "utfsm_sine").glob("*.csv.gz"))
    _run_mrbench(options, "import", *strokes, "--out", folder / "utfsm.mcap")
    yield Case("utfsm", "10mm_2Hz_0.5A*")
    _run_mrbench(options, "import", shared / "data/nees_dyke/ranran_50.csv.gz", "--out", folder / "ranran_50.mcap")
    yield Case("ranran_50")
    for name in _BLIND_CASES:
        _run_mrbench(options, "import", shared / "blind" / f"{name}.csv.gz", "--out", folder / f"{name}.mcap")
        yield Case(name)


def _analyse(options: argparse.Namespace, case: Case) -> list[str]:
    """Identify, predict and diagnose one log; return the failures."""
    log, fit = options.folder / f"{case.name}.mcap", options.folder / f"{case.name}.fit.json"
    held = ("--hold-out", case.hold_out) if case.hold_out else ()
    steps = (
        ("identify", log, "--out", fit, *held),
        ("predict", fit, log, "--out", options.folder / f"{case.name}.prediction.json"),
        ("diagnose", log, "--out", options.folder / f"{case.name}.diagnosis.json"),
    )
    failures = []
    for step in steps:
        try:
            _run_mrbench(options, *step)
        except subprocess.CalledProcessError as error:
            failures.append(f"{step[0]}: {error.stderr.strip().splitlines()[-1]}")
    return failures


def _run_mrbench(options: argparse.Namespace, *words: object) -> None:
    command = [options.mrbench, *map(str, words)]
    # Former versions summed columns of the network in the order of a set, which the hash seed determines.
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    subprocess.run(command, check=True, capture_output=True, text=True, env=environment)


def compare_documents(before: Path, after: Path) -> int:
    """Print one line for each document and difference; return 1 if a number differs or a document is missing."""
    worst = 0
    print("| document | numbers | identifiers | sentences changed | differences |")
    print("| --- | --- | --- | --- | --- |")
    details = []
    for path in sorted(before.glob("*.json")):
        other = after / path.name
        if not other.exists():
            details.append(f"{path.name}: missing in {after}")
            worst = 1
            continue
        old, new = (dict(_iterate_leaves(json.loads(p.read_text()))) for p in (path, other))
        counts = _Counts()
        differences = list(_find_differences(old, new, counts))
        details += [f"{path.name}: {line}" for line in differences]
        worst = max(worst, int(bool(differences)))
        print(
            f"| {path.name} | {counts.numbers} | {counts.identifiers} | {counts.sentences} | {len(differences)} |"
        )
    print("\n".join(details))
    return worst


class _Counts:
    numbers = identifiers = sentences = 0


def _iterate_leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield path and value of all leaves under present names, without the ignored fields."""
    if IGNORED.search(path):
        return
    if isinstance(value, dict):
        if {"name", "form", "parameters"} <= value.keys():
            value = _rename_effect(value)
        for key, inner in value.items():
            name = RENAMED.get(str(key), str(key))
            yield from _iterate_leaves(inner, f"{path}.{name}" if path else name)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from _iterate_leaves(inner, f"{path}[{number}]")
    else:
        yield path, value


def _rename_effect(effect: dict[str, Any]) -> dict[str, Any]:
    """Return an effect with the present names of its form and parameters."""
    name, form, parameters = effect["name"], effect["form"], effect["parameters"]
    return {**effect, "form": form and rename_form(name, form), "parameters": rename_parameters(name, parameters)}


def _find_differences(old: dict[str, Any], new: dict[str, Any], counts: _Counts) -> Iterator[str]:
    for path in sorted(old.keys() | new.keys()):
        if path not in new or path not in old:
            side = "before" if path in old else "after"
            yield f"{path}: only {side}"
            continue
        a, b = old[path], new[path]
        if isinstance(a, str) and isinstance(b, str):
            if _IDENTIFIER.fullmatch(a):
                counts.identifiers += 1
                if RENAMED.get(a, a) != b:
                    yield f"{path}: {a} != {b}"
            else:
                counts.sentences += a != b
        else:
            counts.numbers += 1
            if a != b and not (a is None and b is None):
                yield f"{path}: {a!r} != {b!r}"


if __name__ == "__main__":
    sys.exit(main())
