"""Fits of many logs, each of a specimen of its own; networks that can be trained together are."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from identification.breakdown import breakdown_in_words
from identification.errors import IdentificationError
from identification.identify import Prepared, Progress, Request, conclude, prepare
from identification.recordings import load
from identification.results import Fit
from identification.witness import Testimony, train_together


@dataclass(frozen=True)
class Each:
    """What became of one log."""

    log: Path
    fit: Fit | None
    why_not: str = ""
    """Why there is no fit, in words."""


def places(logs: Sequence[Path], folder: Path) -> list[Path]:
    """Where the document of each log goes.

    Raises:
        IdentificationError: two logs would write the same one.
    """
    found = [folder / f"{log.stem}.json" for log in logs]
    for k, place in enumerate(found):
        if place in found[:k]:
            other = logs[found.index(place)]
            raise IdentificationError(f"{other} and {logs[k]} would both go to {place}; rename one of them")
    return found


def identify_each(
    logs: Sequence[Path], request: Request, progress: Progress = lambda what, error: None
) -> list[Each]:
    """Identify the damper behind each of many logs.

    A log that cannot be fitted does not hold up the others.

    Args:
        logs: each of another specimen.
        request: what is asked of every fit; a budget is that of one log.
        progress: told what is being done and the force error so far [N].
    """
    ready = [_prepared(log, request) for log in logs]
    testimonies = _together(ready, request, progress)
    return [
        _concluded(log, one, request, progress, testimony)
        for log, one, testimony in zip(logs, ready, testimonies, strict=True)
    ]


def _prepared(log: Path, request: Request) -> Prepared | IdentificationError:
    try:
        with breakdown_in_words():
            return prepare([load(log)], request)
    except IdentificationError as error:
        return error


def _together(
    ready: Sequence[Prepared | IdentificationError], request: Request, progress: Progress
) -> list[Testimony | None]:
    """The network's answer for each log, where many can be trained at once."""
    found: list[Testimony | None] = [None] * len(ready)
    usable = {k: one.problem for k, one in enumerate(ready) if isinstance(one, Prepared)}
    if "pinn" in request.stages:
        seed, budget = request.settings.seed, request.network_budget
        answers = train_together(list(usable.values()), request.preset, seed, budget, progress)
        for k, testimony in zip(usable, answers, strict=True):
            found[k] = testimony
    return found


def _concluded(
    log: Path,
    ready: Prepared | IdentificationError,
    request: Request,
    progress: Progress,
    testimony: Testimony | None,
) -> Each:
    if isinstance(ready, IdentificationError):
        return Each(log, None, str(ready))
    try:
        with breakdown_in_words():
            return Each(log, conclude(ready, request, progress, testimony))
    except IdentificationError as error:
        return Each(log, None, str(error))
