"""The study: trials of settings on one recording, kept in a file, shared by several workers.

What is minimised is the honest figure, the force error of the *simulated* law on blocks that the training did not
see, over the noise floor, plus a small price of processor time. A trial that does worse than the median of the
others at the same time is pruned. The study lives in an SQLite file and goes on where it stopped.
"""

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import optuna
from optuna.trial import FrozenTrial, TrialState

from identification.assemble import assemble
from identification.errors import IdentificationError
from identification.identify import fit_problem
from identification.pinn.settings import read_settings
from identification.pinn.supervision import Stopped, Supervision
from identification.pinn.train import train
from identification.recordings import load
from identification.tuning.space import settings_of, suggested

if TYPE_CHECKING:
    from identification.tuning.space import Settings

_DONE = (TrialState.COMPLETE, TrialState.PRUNED)
_STARTUP, _WARM = 6, 2
"""Trials before anything is pruned, and moments of each that do not count."""
_MOMENT = 0.5
"""[s] of processor time between two moments at which trials are compared."""
_FAILED = 100.0
"""[1] value of a trial that ended without any parameters."""


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
    """[s] of processor time for each trial."""
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
    assembled = assemble([load(log) for log in order.logs])
    problem = fit_problem(assembled)
    stretches = [s for s, p in zip(assembled.stretches, assembled.pieces, strict=True) if p.train.any()]

    def value(trial: optuna.Trial) -> float:
        watched = _Watched(trial, problem.noise)
        supervision = Supervision(watched.step, watched.stop, order.budget)
        # Trials are compared at the same processor time, since their steps cost differently.
        watched.clock = lambda: supervision.seconds
        try:
            found = train(problem, suggested(trial, preset), supervision, stretches)
        except Stopped:
            if watched.pruned:
                raise optuna.TrialPruned from None
            return _FAILED
        # A preset may set no block aside to be judged on.
        error = found.simulation.validation or found.simulation.train
        trial.set_user_attr("error", error / problem.noise)
        trial.set_user_attr("seconds", found.seconds)
        trial.set_user_attr("accepted", found.accepted)
        return min(error / problem.noise, _FAILED) + order.price * found.seconds

    def said(study: optuna.Study, trial: FrozenTrial) -> None:
        if progress is not None:
            progress(_in_words(trial))
        # Those of the other workers count, too.
        if len(study.get_trials(states=_DONE, deepcopy=False)) >= order.trials:
            study.stop()

    left = order.trials - len(study.get_trials(states=_DONE, deepcopy=False))
    if left > 0:
        study.optimize(value, n_trials=left, callbacks=[said])


class _Watched:
    """A trial's moments, told to the study; asks whether it shall go on."""

    def __init__(self, trial: optuna.Trial, noise: float) -> None:
        self.clock: Callable[[], float] = lambda: 0.0
        self.pruned = False
        self._trial, self._noise, self._last = trial, noise, -1

    def step(self, what: str, error: float) -> None:
        """Tell the force error [N] of the network now, once a moment."""
        moment = int(self.clock() / _MOMENT)
        if moment > self._last and error == error:  # a NaN says nothing
            self._last = moment
            self._trial.report(error / self._noise, moment)

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
    error, seconds = trial.user_attrs.get("error"), trial.user_attrs.get("seconds")
    if error is None or seconds is None:
        return f"trial {trial.number}: nothing found"
    return f"trial {trial.number}: simulated error {error:.4f} of the noise in {seconds:.1f} s"
