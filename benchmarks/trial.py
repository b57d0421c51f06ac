"""The evidence page of a blind trial: `python -m benchmarks.trial trial.json`, after `mrbench trial`.

A trial that was stopped counts as far as it went: cases that have not been diagnosed are left out, and the page
says how many there were to be.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from sim_rig.trial.answer import CaseAnswer, Trial
from sim_rig.trial.folder import TrialFolder
from sim_rig.trial.run import DIAGNOSE, Plan
from sim_rig.trial.score import scores, share
from sim_rig.trial.table import table
from sim_rig.trial.whole import answer

EVIDENCE = Path(__file__).parent.parent / "docs" / "evidence"
_CLEAR = 1.2
"""[1] refitted law over the floor from which on a shrinkage is asked for."""
_WITHIN = 0.05
"""[1] by which a claimed shrinkage may be off."""
_PAGE = """# The diagnosis on sealed scenarios

{run} of {drawn} cases. Truth drawn and sealed before anything was recorded, in forms of their own; each case
diagnosed from its log alone, then unsealed. [How it works](../explanation/blind-trial.md). Made by

```
{command}
python -m benchmarks.trial trial.json
```

Claimed shrinkage within {within:.0f} points of that of a run which the diagnosis never saw, refitted law above
{clear} times the floor: {shrinkage}.

```
{table}```

## Case by case

| case | kind | strokes | noise | truth (first-order ratio) | verdict | named | truth had | before | after | s |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
{rows}
"""


def page(whole: Trial, drawn: int) -> str:
    """The page of the cases that have been diagnosed."""
    honest = [case for case in whole.cases if case.verdict or "not been diagnosed" not in (case.failure or "")]
    told = whole.model_copy(update={"cases": tuple(honest), "scores": scores(honest)})
    grid = " --grid" if whole.draw == "grid" else ""
    return _PAGE.format(
        run=len(honest),
        drawn=drawn,
        command=f"mrbench trial --cases {drawn} --seed {whole.seed}{grid} --out trial.json",
        within=100 * _WITHIN,
        clear=_CLEAR,
        shrinkage=_shrinkage(honest),
        table=table(told),
        rows="\n".join(map(_row, honest)),
    )


def _shrinkage(cases: Sequence[CaseAnswer]) -> str:
    pairs = [
        (case.claimed_shrinkage, case.true_shrinkage)
        for case in cases
        if (case.before_over_floor or 0.0) > _CLEAR and case.named and case.named.effects
    ]
    found = share(abs(c - t) <= _WITHIN for c, t in pairs if c is not None and t is not None)
    return f"{found.count} of {found.of}"


def _row(case: CaseAnswer) -> str:
    truth = ", ".join(f"{name} ({case.ratios[name]:.2f})" for name in case.truth) or "–"
    named = ", ".join(case.named.effects) if case.named and case.named.effects else "–"
    figures = ["–" if f is None else f"{f:.3f}" for f in (case.before_over_floor, case.after_over_floor)]
    cells = [
        *(case.id, f"{case.kind} {case.magnitude or ''}".strip(), case.method, case.noise, truth),
        *(case.verdict or "none", named if not case.right else f"**{named}**"),
        *(f"{case.probability_of_truth:.2f}", *figures, f"{case.seconds:.0f}"),
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write the page."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("trial", type=Path, help="the answer of `mrbench trial`; its folder stands beside it")
    options.add_argument("--page", type=Path, default=EVIDENCE / "trial.md")
    asked = options.parse_args()
    folder = TrialFolder(asked.trial)
    seal = folder.seal()
    if seal is None:
        raise SystemExit(f"{asked.trial}: no trial has been sealed there; run `mrbench trial` first")
    plan = Plan(seal.cases, seal.seed, seal.draw, 1, 0, DIAGNOSE)
    asked.page.write_text(page(answer(folder, plan), seal.cases), encoding="utf-8")


if __name__ == "__main__":
    main()
