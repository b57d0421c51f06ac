"""Query parameters of the search for runs."""

from datetime import UTC
from http import HTTPStatus
from typing import Annotated

from fastapi import Depends, Query

from bench.catalogue import RunFilter, RunOutcome
from bench.endings import RunEnding
from bench.service.problems import ProblemError
from bench.service.requests import ZonedTime

_NAME = r"^[A-Za-z_][A-Za-z0-9_]*$"
"""Pattern of the names of effects and parameters."""
_MAX_TEXT = 200
_Text = Annotated[str | None, Query(max_length=_MAX_TEXT)]


def _read_search(
    specimen: Annotated[_Text, Query(description="serial number, exactly")] = None,
    bench: Annotated[_Text, Query(description="name of the bench, exactly")] = None,
    method: Annotated[_Text, Query(description="name of the method, exactly")] = None,
    outcome: RunOutcome | None = None,
    ending: RunEnding | None = None,
    started_from: Annotated[
        ZonedTime | None, Query(alias="from", description="earliest start, ISO 8601 with a zone")
    ] = None,
    started_to: Annotated[
        ZonedTime | None, Query(alias="to", description="start before this time, ISO 8601 with a zone")
    ] = None,
    effect: Annotated[
        str | None, Query(pattern=_NAME, max_length=_MAX_TEXT, description="named by the newest diagnosis")
    ] = None,
    parameter: Annotated[
        str | None,
        Query(
            pattern=_NAME,
            max_length=_MAX_TEXT,
            description="parameter of the newest fit, such as `k0`; older fits are only found once made again",
        ),
    ] = None,
    parameter_min: Annotated[
        float | None, Query(allow_inf_nan=False, description="smallest value, in the unit of the fit")
    ] = None,
    parameter_max: Annotated[
        float | None, Query(allow_inf_nan=False, description="largest value, in the unit of the fit")
    ] = None,
    text: Annotated[
        str | None,
        Query(min_length=1, max_length=_MAX_TEXT, description="in specimen, method, operator, reason or a note"),
    ] = None,
    tag: Annotated[_Text, Query(description="tag, exactly")] = None,
    trash: Annotated[bool, Query(description="list the trash instead of all other runs")] = False,
) -> RunFilter:
    """Return the selection of runs that a request asks for.

    Raises:
        ProblemError: a range of values has no parameter, or the other way round, or is empty.
    """
    _check_range(parameter, parameter_min, parameter_max)
    return RunFilter(
        specimen=specimen,
        bench=bench,
        method=method,
        outcome=outcome,
        ending=ending,
        started_from=None if started_from is None else started_from.astimezone(UTC),
        started_to=None if started_to is None else started_to.astimezone(UTC),
        effect=effect,
        parameter=parameter,
        parameter_min=parameter_min,
        parameter_max=parameter_max,
        text=text,
        tag=tag,
        is_trashed=trash,
    )


def _check_range(name: str | None, least: float | None, largest: float | None) -> None:
    has_range = least is not None or largest is not None
    if (name is not None) != has_range:
        present, missing = ("range", "parameter") if has_range else ("parameter", "parameter_min or parameter_max")
        raise _refuse(f"query.parameter: a {present} was given without {missing}; give both")
    if least is not None and largest is not None and least > largest:
        raise _refuse(f"query.parameter_min: {least:g} is above parameter_max {largest:g}; exchange them")


def _refuse(detail: str) -> ProblemError:
    return ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail)


RunSearch = Annotated[RunFilter, Depends(_read_search)]
"""Selection of runs by the query parameters of a request."""
