"""The fit of one or several logs: assemble, train, refine, compare the two, say how sure."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.assemble import Assembled, HoldOut, assemble
from identification.breakdown import breakdown_in_words
from identification.clock_wander import wander_in_words, without_wander
from identification.errors import IdentificationError
from identification.fit_document import MISFIT, Ending, fit_document, of_samples, simulated_errors
from identification.motion_noise import play_noise, with_motion, without_pull
from identification.piece import Piece
from identification.prediction import rmse
from identification.problem import COORDINATE_COUNT, Problem
from identification.profile import profile_intervals
from identification.recordings import Recording, Stretch
from identification.refine import Minimum, Settings, refine
from identification.results import Fit, Provenance, Stage
from identification.search_space import SearchSpace
from identification.start import sliding_damping
from identification.uncertainty import Covariance, covariance, unseen
from identification.usable import strangers, usable
from identification.witness import Testimony, agreement_with, as_minimum, stage_entry, train_stage

if TYPE_CHECKING:
    from identification.pinn.result import PinnResult

_GROWTH = 3.0
"""[1] largest exponent by which the inner displacement may run away within a stretch."""
_OVERSHOOT = 0.005
"""[1] part of the samples at each end of the drive's range that may be overshoots."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Request:
    """What is asked of a fit."""

    hold_out: HoldOut = field(default_factory=HoldOut)
    delay_prior: float | None = None
    """[s] standard deviation of the channel delays beyond what the log reports; None takes the log's clocks."""
    settings: Settings = field(default_factory=Settings)
    stages: tuple[str, ...] = ("refine",)
    """Of ``pinn`` and ``refine``; with both, the fit is refine's and pinn its independent witness."""
    preset: str = "local"
    """Preset of the network, or path of its settings."""
    own: tuple[str, ...] = ()
    """What each log behind the first has of its own: ``offset``, ``viscosity``."""
    profile: bool = False
    """Whether intervals by profile likelihood are wanted, too."""

    @property
    def network_budget(self) -> float | None:
        """[s] of processor time for the network; beside a refinement it may spend half."""
        budget = self.settings.budget
        return 0.5 * budget if budget is not None and "refine" in self.stages else budget


def identify(
    recordings: Sequence[Recording], request: Request = Request(), progress: Progress = lambda what, error: None
) -> Fit:
    """Identify the damper from recordings of it.

    Args:
        recordings: one or several logs of one specimen, driven in the same way.
        request: what is held out, how well the clocks are known, how hard to try.
        progress: told what is being done and the force error so far [N].

    Raises:
        NothingToFit: too little is left to fit.
    """
    with breakdown_in_words():
        return conclude(prepare(recordings, request), request, progress)


@dataclass(frozen=True)
class Prepared:
    """Recordings of one damper that can be used, ready to be fitted."""

    assembled: Assembled
    problem: Problem
    stretches: tuple[Stretch, ...]
    """Behind the problem's pieces."""
    notes: tuple[str, ...]
    """What was left out of the recordings, in words."""


def prepare(recordings: Sequence[Recording], request: Request) -> Prepared:
    """Look over recordings of one damper and say what a fit of them minimises.

    Raises:
        NothingToFit: too little is left to fit.
    """
    cleaned, notes = usable(recordings)
    assembled = assemble(cleaned, request.hold_out)
    problem = replace(fit_problem(assembled, request.delay_prior), own=request.own)
    stretches = [s for s, p in zip(assembled.stretches, assembled.pieces, strict=True) if p.train.any()]
    return Prepared(assembled, problem, tuple(stretches), (*notes, *assembled.notes))


def conclude(prepared: Prepared, request: Request, progress: Progress, testimony: Testimony | None = None) -> Fit:
    """The fit of recordings that can be used; the network is trained, unless its testimony is there already."""
    assembled, problem, stretches = prepared.assembled, prepared.problem, prepared.stretches
    if testimony is None and "pinn" in request.stages:
        testimony = _trained(problem, stretches, request, progress)
    if "refine" in request.stages:
        found = _refined(assembled, problem, stretches, request, progress)
        end = _compared(assembled, found, testimony) if testimony else found
    else:
        end = _network_alone(assembled, problem, testimony)
    assembled = under_conditions(assembled, problem, end.minimum.unknowns[problem.shared])
    fit = fit_document(assembled, end, _provenance(assembled, request, problem))
    if request.profile:
        fit = _profiled(fit, end, progress)
    return fit.model_copy(update={"notes": [*prepared.notes, *end.notes, *_strangers(assembled, fit)]})


def _profiled(fit: Fit, end: Ending, progress: Progress) -> Fit:
    """The fit with intervals by profile likelihood beside its own."""
    intervals = profile_intervals(end.problem, end.minimum, end.covariance, progress)
    coordinates = {
        name: e.model_copy(update={"profile95": intervals.get(name)}) for name, e in fit.coordinates.items()
    }
    return fit.model_copy(update={"coordinates": coordinates})


def _strangers(assembled: Assembled, fit: Fit) -> list[str]:
    """Logs that the common damper does not fit, in words."""
    names = [r.path.name for r in assembled.recordings for _ in r.stretches]
    delays = (fit.nuisances.force_delay.value, fit.nuisances.drive_delay.value)
    if len(set(names)) < 2:
        return []
    errors = simulated_errors(assembled, fit.point(), delays)
    return strangers(names, errors, fit.rmse_n.train / fit.noise_floor_n)


def _trained(problem: Problem, stretches: Sequence[Stretch], request: Request, progress: Progress) -> Testimony:
    """The network's own answer."""
    return train_stage(problem, stretches, request.preset, request.settings.seed, request.network_budget, progress)


def _refined(
    assembled: Assembled, problem: Problem, stretches: Sequence[Stretch], request: Request, progress: Progress
) -> Ending:
    """The output-error fit, from a start of its own."""
    began = time.process_time()
    budget = request.settings.budget
    share = 0.5 if "pinn" in request.stages else 1.0
    settings = replace(request.settings, budget=None if budget is None else share * budget)
    minimum = refine(problem.quicker(), settings, progress)
    # The way goes over the samples alone; filter and play count at its end only (decision 0004).
    polish = replace(settings, restarts=0)
    scatter, notes = None, tuple[str, ...]()
    if _ratio(problem, minimum) > MISFIT:
        # The misfit outweighs what noise of the motion does: that is not played again (decision 0005).
        problem = replace(problem, noise=problem.noise * _ratio(problem, minimum))
        minimum = refine(problem, polish, progress, minimum.unknowns)
    else:
        problem = _smoother_motion(problem, stretches, minimum)
        minimum = refine(problem, polish, progress, minimum.unknowns)
        played = play_noise(problem, stretches, minimum, request.settings.seed)
        minimum, scatter = without_pull(problem, minimum, played.pull), played.scatter
        # Last of all: the minimum carries what the bends leave of the information; evaluated anew it would not.
        minimum, wander = without_wander(problem, minimum)
        notes = wander_in_words(wander)
    found = covariance(problem, minimum, scatter)
    seconds = time.process_time() - began
    error = _train_error(under_conditions(assembled, problem, minimum.unknowns[problem.shared]), problem, minimum)
    stage = Stage(name="refine", seconds=round(seconds, 3), rmse_n=error, iterations=minimum.iterations)
    return Ending(problem, minimum, found, (stage,), notes=notes)


def _network_alone(assembled: Assembled, problem: Problem, testimony: Testimony | None) -> Ending:
    """The fit that rests on the network.

    Raises:
        IdentificationError: it found nothing.
    """
    if testimony is None or testimony.found is None:
        why = testimony.why_not if testimony else "no stage was asked for"
        raise IdentificationError(f"pinn found nothing: {why}; raise --budget or say --stages refine")
    minimum, found = as_minimum(problem, testimony.found)
    why_not = "" if testimony.found.accepted else testimony.found.note
    return Ending(problem, minimum, found, (_stage(assembled, problem, found, testimony.found),), why_not=why_not)


def _compared(assembled: Assembled, found: Ending, testimony: Testimony) -> Ending:
    """The refinement's fit with the network's entry, and whether the two agree."""
    network = testimony.found
    if network is None:
        return replace(found, said=f"not compared: pinn found nothing, {testimony.why_not}")
    agreement = agreement_with(network, found.problem, found.minimum, found.covariance)
    said = agreement.words() if network.accepted else f"{agreement.words()} (pinn: {network.note})"
    stages = (_stage(assembled, found.problem, found.covariance, network), *found.stages)
    return replace(found, stages=stages, agreement=agreement, said=said)


def _stage(assembled: Assembled, problem: Problem, found: Covariance, network: "PinnResult") -> Stage:
    own = under_conditions(assembled, problem, network.unknowns)
    errors = simulated_errors(own, network.coordinates, network.delays)
    held, _ = of_samples(assembled, errors, held=True)
    hidden, _ = unseen(found)
    return stage_entry(network, hidden, rmse(held) if len(held) else None, assembled.drive_unit)


def _train_error(assembled: Assembled, problem: Problem, minimum: Minimum) -> float:
    """Simulated force error [N] on the fitted samples at the end of a descent."""
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    errors = simulated_errors(assembled, point, problem.further_delays(minimum.unknowns))
    return rmse(of_samples(assembled, errors, held=False)[0])


def under_conditions(assembled: Assembled, problem: Problem, shared: Array) -> Assembled:
    """The pieces under what each log was found to have of its own, at unknowns (C,) that no piece has alone."""
    if not problem.own:
        return assembled
    found = {p.log: problem.condition(shared, i) for i, p in enumerate(problem.pieces)}
    pieces = tuple(replace(p, condition=found.get(p.log, p.condition)) for p in assembled.pieces)
    return replace(assembled, pieces=pieces)


def _smoother_motion(problem: Problem, stretches: Sequence[Stretch], minimum: Minimum) -> Problem:
    """The problem with every motion estimated again, the actuator giving way under the fitted force.

    The recorded force would bring its noise into the motion, and what is common to both biases the fit.
    """
    forces = problem.simulate(minimum.unknowns)
    pieces = [
        with_motion(piece, replace(stretch, force=force))
        for piece, stretch, force in zip(problem.pieces, stretches, forces, strict=True)
    ]
    return replace(problem, pieces=tuple(pieces))


def fit_problem(assembled: Assembled, delay_prior: float | None = None) -> Problem:
    """What a fit of some recordings minimises.

    Args:
        assembled: the recordings.
        delay_prior: deviation of the channel delays beyond what the log reports [s]; None takes its clocks.
    """
    # What is held out must not widen the range of drives in which a damper is sought.
    fitted = [p.stroke.drive[p.train > 0] for p in assembled.pieces]
    drives = np.concatenate(fitted)
    prior = assembled.delay_prior if delay_prior is None else delay_prior
    pieces = tuple(p for p in assembled.pieces if p.train.any())
    space = SearchSpace(*_range(drives), lowest_k0=_lowest_k0(pieces))
    # Delays are counted in deviations of their prior; with none at all they would have no unit.
    return Problem(pieces, space, assembled.floor.noise, max(prior, 1e-9))


def _lowest_k0(pieces: Sequence[Piece]) -> float:
    """Stiffness [N/m] at which the inner displacement would grow by e^3 in the longest stretch.

    It moves with the time constant (c0 + c1) / k0. A more negative k0 fits a drift and simulates nonsense.
    """
    longest = max(len(p.force) / p.stroke.rate for p in pieces)
    return -_GROWTH * sliding_damping(pieces) / longest


def _range(drives: Array) -> tuple[float, float]:
    """Lowest and highest drive at which a damper must be one; short overshoots of a driver do not count."""
    low, high = np.quantile(drives, [_OVERSHOOT, 1.0 - _OVERSHOOT])
    return float(low), float(high)


def _ratio(problem: Problem, minimum: Minimum) -> float:
    """Force error over the noise that the problem was weighed with."""
    return float(np.sqrt(minimum.evaluation.cost / problem.samples))


def _provenance(assembled: Assembled, request: Request, problem: Problem) -> Provenance:
    return Provenance(
        logs={r.path.name: r.sha256 for r in assembled.recordings},
        version=version("mrbench"),
        seed=request.settings.seed,
        settings={
            "stages": ",".join(request.stages),
            "preset": request.preset if "pinn" in request.stages else None,
            "hold_out": ",".join(request.hold_out.patterns) or None,
            "hold_out_after": request.hold_out.after,
            "delay_prior_s": problem.delay_prior,
            "free": ",".join(request.own) or None,
            "restarts": request.settings.restarts,
        },
    )
