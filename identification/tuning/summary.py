"""What a study found, as a page and a picture."""

from pathlib import Path
from typing import Any

import matplotlib
import optuna
from matplotlib.figure import Figure
from optuna.importance import PedAnovaImportanceEvaluator
from optuna.trial import TrialState

_SHOWN = 10
"""Trials in the table."""
_FEWEST = 10
"""Trials from which importances mean anything."""


def importances(study: optuna.Study) -> dict[str, float]:
    """Share of each setting in what sets the better trials apart; empty where too few have ended."""
    if len(study.get_trials(states=(TrialState.COMPLETE,), deepcopy=False)) < _FEWEST:
        return {}
    # The usual evaluator needs a random forest; this one needs nothing.
    return dict(optuna.importance.get_param_importances(study, evaluator=PedAnovaImportanceEvaluator()))


def write_picture(path: Path, shares: dict[str, float]) -> None:
    """The importances as bars."""
    matplotlib.use("Agg")
    figure = Figure(figsize=(6.0, 0.4 * len(shares) + 1.0), layout="constrained")
    axes = figure.subplots()
    names = list(reversed(shares))
    axes.barh(names, [shares[name] for name in names], color="#31688e", height=0.6)
    axes.set_xlabel("importance [1]")
    axes.spines[["top", "right"]].set_visible(False)
    # Without the library's version in it: the same study makes the same file.
    figure.savefig(path, dpi=90, metadata={"Software": None})


def page(study: optuna.Study, settings: str, shares: dict[str, float], picture: str | None) -> str:
    """The study in words and tables."""
    trials = study.get_trials(deepcopy=False)
    ended = sorted((t for t in trials if t.state == TrialState.COMPLETE), key=_value)
    pruned = sum(t.state == TrialState.PRUNED for t in trials)
    best = ended[0]
    lines = [
        f"# Tuning of the {study.study_name} network",
        "",
        f"{len(trials)} trials, {len(ended)} to their end, {pruned} pruned; "
        f"preset `{study.user_attrs['preset']}`, which is trial 0. Best: trial {best.number}, simulated error "
        f"{_attribute(best, 'error')} of the noise on blocks that it was not trained on, parameters "
        f"{_attribute(best, 'offset')} deviations from the best simulated fit, {_attribute(best, 'seconds')} s of "
        f"processor time; means over {len(study.user_attrs['logs'])} logs.",
        "",
        "```json",
        settings,
        "```",
        "",
        *_table(ended[:_SHOWN] + [t for t in ended[_SHOWN:] if t.number == 0]),
    ]
    if shares:
        lines += ["", "| setting | importance |", "| --- | ---: |"]
        lines += [f"| `{name}` | {share:.2f} |" for name, share in shares.items()]
    if picture is not None:
        lines += ["", f"![Importance of each setting]({picture})"]
    return "\n".join(lines) + "\n"


def _table(trials: list[optuna.trial.FrozenTrial]) -> list[str]:
    names = list(trials[0].params)
    varied = " | ".join(f"`{name}`" for name in names)
    head = [f"| trial | value | error over noise | offset | s | {varied} |"]
    head.append("| ---: | ---: | ---: | ---: | ---: |" + " ---: |" * len(names))
    for t in trials:
        values = " | ".join(_short(t.params[name]) for name in names)
        measured = " | ".join(_attribute(t, name) for name in ("error", "offset", "seconds"))
        head.append(f"| {t.number} | {_value(t):.4f} | {measured} | {values} |")
    return head


def _value(trial: optuna.trial.FrozenTrial) -> float:
    return float("inf") if trial.value is None else trial.value


def _attribute(trial: optuna.trial.FrozenTrial, name: str) -> str:
    return _short(trial.user_attrs[name]) if name in trial.user_attrs else "–"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
