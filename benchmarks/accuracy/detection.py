"""How small an effect may be and still be found: each effect at parts of its usual size on a short rich method.

Sizes are those of the shipped scenarios, and the forms are the library's own; forms that the library does not have
are the business of `mrbench trial`. Runs without any effect say how often something is named where nothing is.
``--keep FOLDER`` keeps every answer and takes up where an earlier call stopped; ``--cases N`` stops after so many
new ones; ``--page`` writes ``docs/evidence/detection.md`` from what there is.
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
    load_figures,
    make_scenario,
    record_effect,
    time_call,
)
from identification.damper.effects import EFFECTS
from identification.gap import diagnose
from identification.logs import load

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
SIZES = (1.0, 0.5, 0.2, 0.1)
"""[1] of the usual size."""
_RUN_ORDER = (0.2, 0.5, 1.0, 0.1)
"""The same, as they are run: where a call ends early, the middle of the curve is there."""
NULL_RUNS = 50
_PAGE = """# How small an effect may be and still be found

Each effect in the default rig at a part of its usual size, on the shipped method `quick` ({seconds} s, 1 kHz, 3
strokes at six drives); one run a cell and seed. A cell says how many of the runs named the effect, how many named
something else instead, and how far the refitted law stood above the noise floor (1.00 is the floor itself: nothing
shows). Sizes are those of the shipped scenarios, forms are the library's own: these are the odds under a form that
is right. Forms that the library does not have are tried by `mrbench trial`.
Made by

```
python -m benchmarks.accuracy.detection --keep FOLDER --page
```

Without any effect: something named in **{false} of {nulls}** runs ({rate}).

| effect | usual size | {heads} |
| --- | --- | {dashes} |
{rows}

{total} runs, {minutes:.0f} minutes of processor time.
"""


class Case(NamedTuple):
    """One run."""

    effect: str
    size: float
    seed: int

    @property
    def name(self) -> str:
        """Of its files."""
        return f"{self.effect}-{self.size:g}-{self.seed}"


def list_cases(seeds: int) -> Iterator[Case]:
    """Every run, the nulls between the others, so that a part is a fair sample."""
    nulls = iter(range(NULL_RUNS))
    for seed in range(seeds):
        for size in _RUN_ORDER:
            for number, effect in enumerate(COMMON_EFFECTS):
                yield Case(effect, size, seed)
                if number % 4 == 3 and (null := next(nulls, None)) is not None:
                    yield Case(NO_EFFECT, 0.0, null)


def ensure_answer(case: Case, folder: Path) -> bool:
    """Record and diagnose a run, once; whether it was new."""
    out = folder / f"{case.name}.json"
    new = not out.exists()
    load_figures(out, lambda: _diagnose_case(case, folder))
    return new


def _diagnose_case(case: Case, folder: Path) -> dict[str, Any]:
    log = folder / f"{case.name}.mcap"
    record_effect(lengthen_method("quick", 1), case.effect, case.size, 1000 + case.seed, log)
    recording = load(log)
    found, seconds = time_call(lambda: diagnose([recording]).diagnosis)
    answer = {
        **case._asdict(),
        "verdict": found.verdict,
        "named": {e.name: e.probability for e in found.effects},
        "ratio": found.gap.before_n / found.gap.noise_floor_n,
        "seconds": seconds,
        "recorded": sum(len(s.time) / s.rate for s in recording.stretches),
    }
    log.unlink()
    print(f"{case.name}: {found.verdict} {answer['named']} {answer['ratio']:.3f}", flush=True)
    return answer


def render_page(answers: list[dict[str, Any]]) -> str:
    """The page of what has been answered."""
    nulls = [a for a in answers if a["effect"] == NO_EFFECT]
    false = sum(bool(a["named"]) for a in nulls)
    return _PAGE.format(
        seconds=f"{answers[0]['recorded']:.0f}",
        false=false,
        nulls=len(nulls),
        rate=f"{false / max(len(nulls), 1):.0%}",
        heads=" | ".join(f"{size:g} of it" for size in SIZES),
        dashes=" | ".join("---" for _ in SIZES),
        rows="\n".join(_render_row(effect, answers) for effect in COMMON_EFFECTS),
        total=len(answers),
        minutes=sum(a["seconds"] for a in answers) / 60.0,
    )


def _render_row(effect: str, answers: list[dict[str, Any]]) -> str:
    mine = [[a for a in answers if a["effect"] == effect and a["size"] == size] for size in SIZES]
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
    """Run what is missing, and write the page if asked."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--keep", type=Path, required=True, help="folder of the answers")
    options.add_argument("--seeds", type=int, default=1, help="runs a cell")
    options.add_argument("--cases", type=int, default=10**6, help="most new runs in this call")
    options.add_argument("--page", action="store_true", help="write the page")
    asked = options.parse_args()
    asked.keep.mkdir(parents=True, exist_ok=True)
    new = 0
    for case in list_cases(asked.seeds):
        if new >= asked.cases:
            break
        new += ensure_answer(case, asked.keep)
    if asked.page:
        answers = [json.loads(p.read_text("utf-8")) for p in asked.keep.glob("*.json") if "scenario" not in p.name]
        (EVIDENCE / "detection.md").write_text(render_page(answers), encoding="utf-8")


if __name__ == "__main__":
    main()
