"""Fits of many logs, each of another specimen; networks are trained together where that is possible."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from identification.documents import Fit
from identification.errors import IdentificationError
from identification.logs import load
from identification.numerical_errors import translate_numerical_errors
from identification.pipeline.fit_input import FitInput, prepare_fit
from identification.pipeline.fit_request import FitRequest
from identification.pipeline.identification import fit_damper
from identification.pipeline.pinn_stage import NetworkResult, train_networks
from identification.progress import Progress, ignore_progress


@dataclass(frozen=True)
class BatchEntry:
    """Result of one log of a batch."""

    log: Path
    fit: Fit | None
    failure: str = ""
    """Reason why there is no fit, as text for a person."""


def make_output_paths(logs: Sequence[Path], folder: Path) -> list[Path]:
    """Return the path of each log's document.

    Raises:
        IdentificationError: two logs would have the same one.
    """
    paths = [folder / f"{log.stem}.json" for log in logs]
    for k, path in enumerate(paths):
        if path in paths[:k]:
            other = logs[paths.index(path)]
            raise IdentificationError(f"{other} and {logs[k]} would both be written to {path}; rename one of them")
    return paths


def identify_batch(
    logs: Sequence[Path], request: FitRequest, progress: Progress = ignore_progress
) -> Iterator[BatchEntry]:
    """Identify the damper of each log.

    A log that cannot be fitted does not stop the others.

    Args:
        logs: logs, each of another specimen.
        request: request for every fit; its budget is that of one log.
        progress: receives the present activity and the force error so far [N].

    Yields:
        The entry of each log as soon as it is complete, so that a batch that is ended early keeps its results.
        Logs that cannot be fitted come first. The others follow in the groups that are trained together.
    """
    prepared = {log: _try_prepare(log, request) for log in logs}
    yield from (
        BatchEntry(log, None, str(error))
        for log, error in prepared.items()
        if isinstance(error, IdentificationError)
    )
    usable = [(log, fit_input) for log, fit_input in prepared.items() if isinstance(fit_input, FitInput)]
    for number, network in _train_networks([fit_input for _, fit_input in usable], request, progress):
        yield _try_fit(*usable[number], request, progress, network)


def _try_prepare(log: Path, request: FitRequest) -> FitInput | IdentificationError:
    try:
        with translate_numerical_errors():
            return prepare_fit([load(log)], request)
    except IdentificationError as error:
        return error


def _train_networks(
    prepared: Sequence[FitInput], request: FitRequest, progress: Progress
) -> Iterator[tuple[int, NetworkResult | None]]:
    """Return number and network result of each log; None where it is trained alone, or not at all."""
    if "pinn" not in request.stages:
        return ((k, None) for k in range(len(prepared)))
    problems = [fit_input.problem for fit_input in prepared]
    return train_networks(problems, request.preset, request.settings.seed, request.network_budget, progress)


def _try_fit(
    log: Path, prepared: FitInput, request: FitRequest, progress: Progress, network: NetworkResult | None
) -> BatchEntry:
    try:
        with translate_numerical_errors():
            return BatchEntry(log, fit_damper(prepared, request, progress, network))
    except IdentificationError as error:
        return BatchEntry(log, None, str(error))
