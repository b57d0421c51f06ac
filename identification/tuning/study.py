"""The study: trials of settings on some recordings, kept in a file, shared by several workers.

What is minimised is, in the mean over the recordings,

    error + (sqrt(1 + offset²) - 1) + price * seconds

with the force error of the *simulated* law on blocks that the training did not see, over the noise floor; the
parameters' offset from the best simulated fit in standard deviations, as the factor by which it widens the error
of an estimate that has a deviation of its own; and the processor time. A trial that does worse than the median of
the others at the same time is pruned. The study lives in an SQLite file and goes on where it stopped.
"""

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import optuna
from optuna.trial import FrozenTrial, TrialState

from identification.assemble import assemble
from identification.errors import IdentificationError
from identification.identify import fit_problem
from identification.pinn.settings import read_settings
from identification.pinn.supervision import Stopped, Supervision
from identification.pinn.train import train
from identification.problem import Problem
from identification.recordings import load
from identification.tuning.offset import offset
from identification.tuning.space import settings_of, suggested, values_of

if TYPE_CHECKING:
    from identification.tuning.space import Settings

_DONE = (TrialState.COMPLETE, TrialState.PRUNED)
_STARTUP, _WARM = 6, 2
"""Trials before anything is pruned, and moments of each that do not count."""
_MOMENT = 0.5
"""[s] of processor time between two moments at which trials are compared."""
_APART = 100_000
"""Moments from the beginning of one recording to that of the next."""
_FAILED = 100.0
"""[1] value of a trial that ended without any parameters."""


class Result(NamedTuple):
    """How a training ended."""

    error: float
    """[1] of the simulated law on blocks set aside, over the noise."""
    offset: float
    """[1] deviations from the best simulated fit."""
    seconds: float
    """[s] of processor time."""

    def value(self, price: float) -> float:
        """[1] what the study minimises."""
        return min(self.error + float(np.hypot(1.0, self.offset)) - 1.0, _FAILED) + price * self.seconds


@dataclass(frozen=True)
class Order:
    """What a study is asked for."""

    logs: tuple[Path, ...]
    preset: str
    study: Path
    """The SQLite file."""
    trials: int
    """Trials in all, those of earlier calls included."""
    budget: float
    """[s] of processor time for one training."""
    price: float
    """[1/s] what a second of processor time adds to the value."""
    seed: int

    @property
    def storage(self) -> str:
        """The study's place as optuna names it."""
        return f"sqlite:///{self.study.resolve()}"


def run(order: Order, workers: int, progress: Callable[[str], None]) -> optuna.Study:
    """Carry a study on until it has its trials.

    Args:
        order: what is asked for.
        workers: processes that work on it.
        progress: told of every trial done here.

    Raises:
        IdentificationError: a worker failed, or the file holds another network's study.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = _open(order)
    if workers == 1:
        work(order, progress)
    else:
        # Forked, a worker would inherit the open database, and torch's threads where it is loaded.
        context = multiprocessing.get_context("spawn")
        hands = [context.Process(target=work, args=(order, None, k)) for k in range(workers)]
        for hand in hands:
            hand.start()
        for hand in hands:
            hand.join()
        if any(hand.exitcode for hand in hands):
            raise IdentificationError(f"{order.study}: a worker failed; what is done is kept, call again to go on")
    return study


def work(order: Order, progress: Callable[[str], None] | None = None, worker: int = 0) -> None:
    """One worker: trials until the study has enough."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = _open(order, worker)
    preset = read_settings(order.preset).model_copy(update={"seed": order.seed})
    # Each log is a damper of its own.
    problems = [fit_problem(assemble([load(log)])) for log in order.logs]

    def value(trial: optuna.Trial) -> float:
        settings, results = suggested(trial, preset), list[Result]()
        for number, problem in enumerate(problems):
            watched = _Watched(trial, problem.noise, number * _APART)
            try:
                results.append(_trained(problem, settings, watched, order.budget))
            except Stopped:
                if watched.pruned:
                    raise optuna.TrialPruned from None
                return _FAILED
        for name, column in zip(Result._fields, zip(*results, strict=True), strict=True):
            trial.set_user_attr(name, fmean(column))
        return fmean(result.value(order.price) for result in results)

    def said(study: optuna.Study, trial: FrozenTrial) -> None:
        if progress is not None:
            progress(_in_words(trial))
        # Those of the other workers count, too.
        if len(study.get_trials(states=_DONE, deepcopy=False)) >= order.trials:
            study.stop()

    left = order.trials - len(study.get_trials(states=_DONE, deepcopy=False))
    if left > 0:
        study.optimize(value, n_trials=left, callbacks=[said])


def _trained(problem: Problem, settings: "Settings", watched: "_Watched", budget: float) -> Result:
    supervision = Supervision(watched.step, watched.stop, budget)
    # Trials are compared at the same processor time, since their steps cost differently.
    watched.clock = lambda: supervision.seconds
    # Without the stretches, the motion stays that of the fit from which the offset is counted.
    found = train(problem, settings, supervision)
    # A preset may set no block aside to be judged on.
    error = found.simulation.validation or found.simulation.train
    return Result(error / problem.noise, offset(problem, found), found.seconds)


class _Watched:
    """A trial's moments on one recording, told to the study; asks whether it shall go on."""

    def __init__(self, trial: optuna.Trial, noise: float, first: int) -> None:
        self.clock: Callable[[], float] = lambda: 0.0
        self.pruned = False
        self._trial, self._noise, self._first, self._last = trial, noise, first, -1

    def step(self, what: str, error: float) -> None:
        """Tell the force error [N] of the network now, once a moment."""
        moment = int(self.clock() / _MOMENT)
        if moment > self._last and np.isfinite(error):  # what is not yet known says nothing
            self._last = moment
            self._trial.report(error / self._noise, self._first + moment)

    def stop(self) -> bool:
        """Whether the trial is hopeless beside the others."""
        self.pruned = self.pruned or self._trial.should_prune()
        return self.pruned


def _open(order: Order, worker: int = 0) -> optuna.Study:
    network = read_settings(order.preset).network
    study = optuna.create_study(
        storage=order.storage,
        study_name=network,
        # A seed of its own, or all workers would try the same settings.
        sampler=optuna.samplers.TPESampler(seed=order.seed + worker, multivariate=False),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=_STARTUP, n_warmup_steps=_WARM),
        load_if_exists=True,
    )
    # Values of other logs or of another preset would not compare.
    asked = {"logs": [str(log) for log in order.logs], "preset": order.preset}
    if not study.user_attrs:
        for name, given in asked.items():
            study.set_user_attr(name, given)
        # The preset itself comes first: what the others are compared with.
        study.enqueue_trial(values_of(read_settings(order.preset)))
    if any(study.user_attrs.get(name) != given for name, given in asked.items()):
        raise IdentificationError(
            f"{order.study}: holds a study of {study.user_attrs}; give another --study for other logs or presets"
        )
    return study


def best_settings(study: optuna.Study, preset: str) -> "Settings":
    """The preset with the values of the best trial."""
    base = read_settings(preset)
    return settings_of(base, study.best_trial.params)


def _in_words(trial: FrozenTrial) -> str:
    if trial.state == TrialState.PRUNED:
        return f"trial {trial.number}: pruned"
    try:
        error, apart, seconds = (trial.user_attrs[name] for name in Result._fields)
    except KeyError:
        return f"trial {trial.number}: nothing found"
    return f"trial {trial.number}: {error:.4f} of the noise, {apart:.2f} deviations off, {seconds:.1f} s"
