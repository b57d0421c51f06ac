"""Tuning study: trials of settings on some recordings, stored in one SQLite file and shared by several workers.

The objective is the mean over the recordings of

    error + (sqrt(1 + offset²) - 1) + time_weight * seconds

The error is that of the *simulated* law on blocks that the training did not use, over the noise floor. The offset
is the distance of the parameters from the best simulated fit, in standard deviations. Its term is the relative
growth of the error of an estimate with a standard deviation of one. Seconds are processor time. A trial that
is worse than the median of the others at the same time is pruned. An interrupted study is continued from its file.
"""

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

import numpy as np
import optuna
from optuna.trial import FrozenTrial, TrialState

from identification.errors import IdentificationError
from identification.fitting import Budget, Problem, assemble
from identification.logs import load
from identification.pinn import train
from identification.pinn.common import (
    PinnSettings,
    TrainingMonitor,
    TrainingStopped,
    read_settings,
    rename_preset,
)
from identification.pipeline import make_problem
from identification.tuning.offset import estimate_offset
from identification.tuning.space import apply_values, extract_values, suggest_settings

_FINISHED_STATES = (TrialState.COMPLETE, TrialState.PRUNED)
_STARTUP_TRIALS, _WARMUP_STEPS = 6, 2
"""Trials before any is pruned, and reports of each trial that do not count."""
_REPORT_INTERVAL = 0.5
"""Processor time between two reports at which trials are compared [s]."""
_RECORDING_OFFSET = 100_000
"""Distance of the report numbers of one recording from those of the next."""
_FAILED_VALUE = 100.0
"""Objective of a trial that ended without parameters [1]."""


class TrialResult(NamedTuple):
    """Result of a trial on one recording; the study stores its fields under these names."""

    error: float
    """Error of the simulated law on validation blocks, over the noise [1]."""
    offset: float
    """Distance from the best simulated fit [standard deviations]."""
    seconds: float
    """Processor time [s]."""

    def compute_value(self, time_weight: float) -> float:
        """Return the objective [1]."""
        return (
            min(self.error + float(np.hypot(1.0, self.offset)) - 1.0, _FAILED_VALUE) + time_weight * self.seconds
        )


@dataclass(frozen=True)
class StudyRequest:
    """Logs, preset and extent of a study."""

    logs: tuple[Path, ...]
    preset: str
    study: Path
    """SQLite file of the study."""
    trials: int
    """Number of trials in total, those of earlier calls included."""
    budget: float
    """Processor time of one training [s]."""
    time_weight: float
    """Weight of one second of processor time in the objective [1/s]."""
    seed: int

    @property
    def storage(self) -> str:
        """The study's file as an address for optuna."""
        return f"sqlite:///{self.study.resolve()}"


def run_study(request: StudyRequest, workers: int, progress: Callable[[str], None]) -> optuna.Study:
    """Begin or continue a study until it has its number of trials.

    Args:
        request: logs, preset and extent of the study.
        workers: number of processes.
        progress: receives a message for every trial of this process.

    Raises:
        IdentificationError: a worker failed, or the file contains a study of other logs or of another preset.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = _open_study(request)
    if workers == 1:
        run_worker(request, progress)
        return study
    # A forked worker would inherit the open database, and torch's threads if torch is loaded.
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=run_worker, args=(request, None, k)) for k in range(workers)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    if any(process.exitcode for process in processes):
        raise IdentificationError(
            f"{request.study}: a worker failed; finished trials are stored, repeat the command to continue"
        )
    return study


def run_worker(request: StudyRequest, progress: Callable[[str], None] | None = None, worker: int = 0) -> None:
    """Run trials until the study has its number of trials."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = _open_study(request, worker)
    preset = read_settings(request.preset).model_copy(update={"seed": request.seed})
    # Each log is of another damper.
    problems = [make_problem(assemble([load(log)])) for log in request.logs]

    def compute_objective(trial: optuna.Trial) -> float:
        settings, results = suggest_settings(trial, preset), list[TrialResult]()
        for number, problem in enumerate(problems):
            monitor = _TrialMonitor(trial, problem.noise, number * _RECORDING_OFFSET)
            try:
                results.append(_run_trial(problem, settings, monitor, request.budget))
            except TrainingStopped:
                if monitor.pruned:
                    raise optuna.TrialPruned from None
                return _FAILED_VALUE
        for name, column in zip(TrialResult._fields, zip(*results, strict=True), strict=True):
            trial.set_user_attr(name, fmean(column))
        return fmean(result.compute_value(request.time_weight) for result in results)

    def on_trial(study: optuna.Study, trial: FrozenTrial) -> None:
        if progress is not None:
            progress(_describe_trial(trial))
        # Trials of other workers count as well.
        if len(study.get_trials(states=_FINISHED_STATES, deepcopy=False)) >= request.trials:
            study.stop()

    remaining = request.trials - len(study.get_trials(states=_FINISHED_STATES, deepcopy=False))
    if remaining > 0:
        study.optimize(compute_objective, n_trials=remaining, callbacks=[on_trial])


def _run_trial(
    problem: Problem, settings: PinnSettings, trial_monitor: "_TrialMonitor", budget: float
) -> TrialResult:
    monitor = TrainingMonitor(trial_monitor.report, trial_monitor.should_stop, Budget(seconds=budget))
    # Trials are compared at the same processor time, because the cost of a step depends on the settings.
    trial_monitor.clock = lambda: monitor.seconds
    # Without the stretches, the motion is that of the fit from which the offset is counted.
    result = train(problem, settings, monitor)
    # A preset may set no validation blocks aside.
    error = result.simulation.validation or result.simulation.train
    return TrialResult(error / problem.noise, estimate_offset(problem, result), result.seconds)


class _TrialMonitor:
    """Reports of one trial on one recording to the study, and the study's decision to prune it."""

    def __init__(self, trial: optuna.Trial, noise: float, first: int) -> None:
        self.clock: Callable[[], float] = lambda: 0.0
        self.pruned = False
        self._trial, self._noise, self._first, self._last = trial, noise, first, -1

    def report(self, _message: str, error: float) -> None:
        """Report the network's present force error [N], once in each interval, unless it is unknown (NaN)."""
        number = int(self.clock() / _REPORT_INTERVAL)
        if number > self._last and np.isfinite(error):
            self._last = number
            self._trial.report(error / self._noise, self._first + number)

    def should_stop(self) -> bool:
        """Return whether the trial is to be pruned."""
        self.pruned = self.pruned or self._trial.should_prune()
        return self.pruned


def _open_study(request: StudyRequest, worker: int = 0) -> optuna.Study:
    """Open or create the study, also under a former name of its network and preset."""
    preset = rename_preset(request.preset)
    settings = read_settings(preset)
    stored_names = optuna.get_all_study_names(request.storage)
    study = optuna.create_study(
        storage=request.storage,
        study_name=next((n for n in stored_names if rename_preset(n) == settings.network), settings.network),
        # With one seed, all workers would try the same settings.
        sampler=optuna.samplers.TPESampler(seed=request.seed + worker, multivariate=False),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=_STARTUP_TRIALS, n_warmup_steps=_WARMUP_STEPS),
        load_if_exists=True,
    )
    logs = [str(log) for log in request.logs]
    if not study.user_attrs:
        study.set_user_attr("logs", logs)
        study.set_user_attr("preset", preset)
        # The preset itself is the first trial, as the reference of the others.
        study.enqueue_trial(extract_values(settings))
    # Objectives of other logs or of another preset are not comparable.
    if study.user_attrs.get("logs") != logs or rename_preset(study.user_attrs.get("preset", "")) != preset:
        raise IdentificationError(
            f"{request.study}: contains a study of {study.user_attrs}; "
            "use another --study for other logs or presets"
        )
    return study


def get_best_settings(study: optuna.Study, preset: str) -> PinnSettings:
    """Return the preset with the values of the best trial."""
    return apply_values(read_settings(preset), study.best_trial.params)


def _describe_trial(trial: FrozenTrial) -> str:
    if trial.state == TrialState.PRUNED:
        return f"trial {trial.number}: pruned"
    try:
        error, offset, seconds = (trial.user_attrs[name] for name in TrialResult._fields)
    except KeyError:
        return f"trial {trial.number}: no parameters found"
    return f"trial {trial.number}: {error:.4f} of the noise, {offset:.2f} deviations off, {seconds:.1f} s"
