"""Summary of a tuning study as a page and a plot."""

from pathlib import Path
from typing import Any

import matplotlib
import optuna
from matplotlib.figure import Figure
from optuna.importance import PedAnovaImportanceEvaluator
from optuna.trial import FrozenTrial, TrialState

from identification.pinn.common import rename_preset
from identification.tuning.space import describe_parameter

_TABLE_TRIALS = 10
"""Number of trials in the table."""
_MIN_TRIALS = 10
"""Smallest number of trials for which importances are computed."""


def compute_importances(study: optuna.Study) -> dict[str, float]:
    """Return the importance [1] of each varied setting for the objective; empty if too few trials have ended."""
    if len(study.get_trials(states=(TrialState.COMPLETE,), deepcopy=False)) < _MIN_TRIALS:
        return {}
    # optuna's default evaluator needs scikit-learn; this one has no dependencies.
    importances = optuna.importance.get_param_importances(study, evaluator=PedAnovaImportanceEvaluator())
    network = rename_preset(study.study_name)
    return {describe_parameter(name, network): value for name, value in importances.items()}


def write_plot(path: Path, importances: dict[str, float]) -> None:
    """Write the importances as a bar chart."""
    matplotlib.use("Agg")
    figure = Figure(figsize=(6.0, 0.4 * len(importances) + 1.0), layout="constrained")
    axes = figure.subplots()
    names = list(reversed(importances))
    axes.barh(names, [importances[name] for name in names], color="#31688e", height=0.6)
    axes.set_xlabel("importance [1]")
    axes.spines[["top", "right"]].set_visible(False)
    # Without the version of the library, the same study yields the same file.
    figure.savefig(path, dpi=90, metadata={"Software": None})


def format_summary(
    study: optuna.Study, settings: str, importances: dict[str, float], plot_name: str | None
) -> str:
    """Return the study as a page in Markdown.

    Args:
        study: a study with at least one complete trial.
        settings: best settings as JSON.
        importances: importance of each varied setting; empty if unknown.
        plot_name: file name of the plot; None without a plot.
    """
    trials = study.get_trials(deepcopy=False)
    complete = sorted((t for t in trials if t.state == TrialState.COMPLETE), key=_get_value)
    network = rename_preset(study.study_name)
    lines = [
        f"# Tuning of the network `{network}`",
        "",
        _describe_study(study, trials, complete),
        "",
        "```json",
        settings,
        "```",
        "",
        *_format_table(complete[:_TABLE_TRIALS] + [t for t in complete[_TABLE_TRIALS:] if t.number == 0], network),
    ]
    if importances:
        lines += ["", "| setting | importance |", "| --- | ---: |"]
        lines += [f"| `{name}` | {importance:.2f} |" for name, importance in importances.items()]
    if plot_name is not None:
        lines += ["", f"![Importance of each setting]({plot_name})"]
    return "\n".join(lines) + "\n"


def _describe_study(study: optuna.Study, trials: list[FrozenTrial], complete: list[FrozenTrial]) -> str:
    best, pruned = complete[0], sum(t.state == TrialState.PRUNED for t in trials)
    error, offset, seconds = (_format_attribute(best, name) for name in ("error", "offset", "seconds"))
    return (
        f"{len(trials)} trials, {len(complete)} complete, {pruned} pruned. Trial 0 is the preset "
        f"`{rename_preset(study.user_attrs['preset'])}`. The best is trial {best.number}: simulated error {error} "
        f"of the noise on validation blocks, parameters {offset} deviations from the best simulated fit, "
        f"{seconds} s of processor time; means over {len(study.user_attrs['logs'])} logs."
    )


def _format_table(trials: list[FrozenTrial], network: str) -> list[str]:
    names = list(trials[0].params)
    varied = " | ".join(f"`{describe_parameter(name, network)}`" for name in names)
    lines = [f"| trial | value | error over noise | offset | s | {varied} |"]
    lines.append("| ---: | ---: | ---: | ---: | ---: |" + " ---: |" * len(names))
    for t in trials:
        values = " | ".join(_format_value(t.params[name]) for name in names)
        measured = " | ".join(_format_attribute(t, name) for name in ("error", "offset", "seconds"))
        lines.append(f"| {t.number} | {_get_value(t):.4f} | {measured} | {values} |")
    return lines


def _get_value(trial: FrozenTrial) -> float:
    return float("inf") if trial.value is None else trial.value


def _format_attribute(trial: FrozenTrial, name: str) -> str:
    return _format_value(trial.user_attrs[name]) if name in trial.user_attrs else "–"


def _format_value(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
