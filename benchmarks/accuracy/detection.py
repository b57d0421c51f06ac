"""Detection limit of effects: each effect at fractions of its usual size, on a short rich method.

Sizes are those of the shipped scenarios, and forms are those of the library; `mrbench trial` tests other forms.
Runs without any effect measure the rate of false alarms. ``--keep FOLDER`` keeps all results and continues an
interrupted call. ``--cases N`` stops after N new runs. ``--page`` writes ``docs/evidence/detection.md`` from the
existing results.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.common import (
    COMMON_EFFECTS,
    NO_EFFECT,
    lengthen_method,
    load_results,
    make_scenario,
    record_effect,
    time_call,
)
from identification.damper.effects import EFFECTS
from identification.gap import diagnose
from identification.logs import load

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
SIZES = (1.0, 0.5, 0.2, 0.1)
"""Fractions of the usual size [1]."""
_RUN_ORDER = (0.2, 0.5, 1.0, 0.1)
"""Order in which the sizes are run: an interrupted call has the middle of the curve."""
NULL_RUNS = 50
"""Number of runs without an effect."""
_PAGE = """# Detection limit of effects

Each effect in the default rig at a fraction of its usual size, on the shipped method `quick` ({seconds} s, 1 kHz,
3 strokes at six drives), with one run for each cell and seed. A cell contains the number of runs that named the
effect, the number that named another one, and the error of the refitted law over the noise floor (1.00: no visible
gap). Sizes are those of the shipped scenarios. Forms are those of the library, so these rates hold for a form that
is known. `mrbench trial` tests forms outside the library. Command:

```
python -m benchmarks.accuracy.detection --keep FOLDER --page
```

Without any effect: an effect was named in **{false} of {nulls}** runs ({rate}).

| effect | usual size | {heads} |
| --- | --- | {dashes} |
{rows}

{total} runs, {minutes:.0f} minutes of processor time.
"""


class Case(NamedTuple):
    """Run with one effect at one size."""

    effect: str
    size: float
    seed: int

    @property
    def name(self) -> str:
        """Base name of the files of this run."""
        return f"{self.effect}-{self.size:g}-{self.seed}"


def list_cases(seeds: int) -> Iterator[Case]:
    """List all runs; those without effect are spread between the others, so that each part is a fair sample."""
    nulls = iter(range(NULL_RUNS))
    for seed in range(seeds):
        for size in _RUN_ORDER:
            for number, effect in enumerate(COMMON_EFFECTS):
                yield Case(effect, size, seed)
                if number % 4 == 3 and (null := next(nulls, None)) is not None:
                    yield Case(NO_EFFECT, 0.0, null)


def ensure_result(case: Case, folder: Path) -> bool:
    """Record and diagnose a run unless its result exists; return whether it was new."""
    out = folder / f"{case.name}.json"
    new = not out.exists()
    load_results(out, lambda: _diagnose_case(case, folder))
    return new


def _diagnose_case(case: Case, folder: Path) -> dict[str, Any]:
    log = folder / f"{case.name}.mcap"
    record_effect(lengthen_method("quick", 1), case.effect, case.size, 1000 + case.seed, log)
    recording = load(log)
    found, seconds = time_call(lambda: diagnose([recording]).diagnosis)
    result = {
        **case._asdict(),
        "verdict": found.verdict,
        "named": {e.name: e.probability for e in found.effects},
        "ratio": found.gap.before_n / found.gap.noise_floor_n,
        "seconds": seconds,
        "recorded": sum(len(s.time) / s.rate for s in recording.stretches),
    }
    log.unlink()
    print(f"{case.name}: {found.verdict} {result['named']} {result['ratio']:.3f}", flush=True)
    return result


def render_page(results: list[dict[str, Any]]) -> str:
    """Return the page of the existing results."""
    nulls = [a for a in results if a["effect"] == NO_EFFECT]
    false = sum(bool(a["named"]) for a in nulls)
    return _PAGE.format(
        seconds=f"{results[0]['recorded']:.0f}",
        false=false,
        nulls=len(nulls),
        rate=f"{false / max(len(nulls), 1):.0%}",
        heads=" | ".join(f"{size:g} times" for size in SIZES),
        dashes=" | ".join("---" for _ in SIZES),
        rows="\n".join(_render_row(effect, results) for effect in COMMON_EFFECTS),
        total=len(results),
        minutes=sum(a["seconds"] for a in results) / 60.0,
    )


def _render_row(effect: str, results: list[dict[str, Any]]) -> str:
    mine = [[a for a in results if a["effect"] == effect and a["size"] == size] for size in SIZES]
    return f"| {effect} | {_describe_size(effect)} | {' | '.join(map(_render_cell, mine))} |"


def _describe_size(effect: str) -> str:
    (entry,) = make_scenario(effect, 1.0)["effects"]
    units = {q.symbol: q.format_unit("V") for q in EFFECTS[effect].find_form(entry.get("form")).parameters}
    parts = [f"{k} {v:g} {'' if units[k] == '1' else units[k]}".rstrip() for k, v in entry["parameters"].items()]
    return ", ".join(parts)


def _render_cell(runs: list[dict[str, Any]]) -> str:
    if not runs:
        return "not run"
    found = sum(a["effect"] in a["named"] for a in runs)
    other = sum(bool(a["named"]) and a["effect"] not in a["named"] for a in runs)
    ratio = sum(a["ratio"] for a in runs) / len(runs)
    wrong = f", other {other}" if other else ""
    return f"{found} of {len(runs)}{wrong} ({ratio:.2f})"


def main() -> None:
    """Run the missing cases, and write the page on request."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--keep", type=Path, required=True, help="folder of the results")
    options.add_argument("--seeds", type=int, default=1, help="runs for each cell")
    options.add_argument("--cases", type=int, default=10**6, help="largest number of new runs in this call")
    options.add_argument("--page", action="store_true", help="write the page")
    asked = options.parse_args()
    asked.keep.mkdir(parents=True, exist_ok=True)
    new = 0
    for case in list_cases(asked.seeds):
        if new >= asked.cases:
            break
        new += ensure_result(case, asked.keep)
    if asked.page:
        results = [json.loads(p.read_text("utf-8")) for p in asked.keep.glob("*.json") if "scenario" not in p.name]
        (EVIDENCE / "detection.md").write_text(render_page(results), encoding="utf-8")


if __name__ == "__main__":
    main()
