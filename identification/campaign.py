"""Fits of many logs, each of a specimen of its own; networks that can be trained together are."""

from collections.abc import Iterator, Sequence
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
) -> Iterator[Each]:
    """Identify the damper behind each of many logs.

    A log that cannot be fitted does not hold up the others.

    Args:
        logs: each of another specimen.
        request: what is asked of every fit; a budget is that of one log.
        progress: told what is being done and the force error so far [N].

    Yields:
        What became of a log as soon as that is known, so that nothing is lost of a campaign that is ended early:
        first those that cannot be fitted, then the others, batch by batch of those that are trained together.
    """
    ready = {log: _prepared(log, request) for log in logs}
    yield from (Each(log, None, str(why)) for log, why in ready.items() if isinstance(why, IdentificationError))
    usable = [(log, one) for log, one in ready.items() if isinstance(one, Prepared)]
    for number, testimony in _together([one for _, one in usable], request, progress):
        yield _concluded(*usable[number], request, progress, testimony)


def _prepared(log: Path, request: Request) -> Prepared | IdentificationError:
    try:
        with breakdown_in_words():
            return prepare([load(log)], request)
    except IdentificationError as error:
        return error


def _together(
    ready: Sequence[Prepared], request: Request, progress: Progress
) -> Iterator[tuple[int, Testimony | None]]:
    """Number and network's answer of each; None where it is trained alone, or not at all."""
    if "pinn" not in request.stages:
        return ((k, None) for k in range(len(ready)))
    problems = [one.problem for one in ready]
    return train_together(problems, request.preset, request.settings.seed, request.network_budget, progress)


def _concluded(
    log: Path, ready: Prepared, request: Request, progress: Progress, testimony: Testimony | None
) -> Each:
    try:
        with breakdown_in_words():
            return Each(log, conclude(ready, request, progress, testimony))
    except IdentificationError as error:
        return Each(log, None, str(error))
