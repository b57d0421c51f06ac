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

from benchmarks.effect_logs import NOTHING, USUAL, record, scenario, stretched
from benchmarks.kept import figures
from benchmarks.timing import timed
from identification.damper.effects import EFFECTS
from identification.gap.diagnose import diagnose
from identification.recordings import load

EVIDENCE = Path(__file__).parent.parent / "docs" / "evidence"
SIZES = (1.0, 0.5, 0.2, 0.1)
"""[1] of the usual size."""
_ORDER = (0.2, 0.5, 1.0, 0.1)
"""The same, as they are run: where a call ends early, the middle of the curve is there."""
NULLS = 50
_PAGE = """# How small an effect may be and still be found

Each effect in the default rig at a part of its usual size, on the shipped method `quick` ({seconds} s, 1 kHz, 3
strokes at six drives); one run a cell and seed. A cell says how many of the runs named the effect, how many named
something else instead, and how far the refitted law stood above the noise floor (1.00 is the floor itself: nothing
shows). Sizes are those of the shipped scenarios, forms are the library's own: these are the odds under a form that
is right. Forms that the library does not have are tried by `mrbench trial`.
Made by

```
python -m benchmarks.detection --keep FOLDER --page
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


def cases(seeds: int) -> Iterator[Case]:
    """Every run, the nulls between the others, so that a part is a fair sample."""
    nulls = iter(range(NULLS))
    for seed in range(seeds):
        for size in _ORDER:
            for number, effect in enumerate(USUAL):
                yield Case(effect, size, seed)
                if number % 4 == 3 and (null := next(nulls, None)) is not None:
                    yield Case(NOTHING, 0.0, null)


def answered(case: Case, folder: Path) -> bool:
    """Record and diagnose a run, once; whether it was new."""
    out = folder / f"{case.name}.json"
    new = not out.exists()
    figures(out, lambda: _answer(case, folder))
    return new


def _answer(case: Case, folder: Path) -> dict[str, Any]:
    log = folder / f"{case.name}.mcap"
    record(stretched("quick", 1), case.effect, case.size, 1000 + case.seed, log)
    recording = load(log)
    found, seconds = timed(lambda: diagnose([recording]).diagnosis)
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


def page(answers: list[dict[str, Any]]) -> str:
    """The page of what has been answered."""
    nulls = [a for a in answers if a["effect"] == NOTHING]
    false = sum(bool(a["named"]) for a in nulls)
    return _PAGE.format(
        seconds=f"{answers[0]['recorded']:.0f}",
        false=false,
        nulls=len(nulls),
        rate=f"{false / max(len(nulls), 1):.0%}",
        heads=" | ".join(f"{size:g} of it" for size in SIZES),
        dashes=" | ".join("---" for _ in SIZES),
        rows="\n".join(_row(effect, answers) for effect in USUAL),
        total=len(answers),
        minutes=sum(a["seconds"] for a in answers) / 60.0,
    )


def _row(effect: str, answers: list[dict[str, Any]]) -> str:
    mine = [[a for a in answers if a["effect"] == effect and a["size"] == size] for size in SIZES]
    return f"| {effect} | {_usual(effect)} | {' | '.join(map(_cell, mine))} |"


def _usual(effect: str) -> str:
    (entry,) = scenario(effect, 1.0)["effects"]
    units = {q.symbol: q.unit_for("V") for q in EFFECTS[effect].form(entry.get("form")).parameters}
    parts = [f"{k} {v:g} {'' if units[k] == '1' else units[k]}".rstrip() for k, v in entry["parameters"].items()]
    return ", ".join(parts)


def _cell(runs: list[dict[str, Any]]) -> str:
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
    for case in cases(asked.seeds):
        if new >= asked.cases:
            break
        new += answered(case, asked.keep)
    if asked.page:
        answers = [json.loads(p.read_text("utf-8")) for p in asked.keep.glob("*.json") if "scenario" not in p.name]
        (EVIDENCE / "detection.md").write_text(page(answers), encoding="utf-8")


if __name__ == "__main__":
    main()
