"""Errors as `application/problem+json` (RFC 9457), with a stable type for each kind and without traceback."""

import logging
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException

from bench.errors import AgentUnreachableError, BenchError, LogError, MethodError

MEDIA_TYPE = "application/problem+json"
_LOG = logging.getLogger(__name__)


class Problem(BaseModel):
    """Error of a request."""

    type: str = Field(description="`urn:mrbench:problem:NAME` with a stable name, for programs")
    title: str = Field(description="kind of error, for a person")
    status: int = Field(description="HTTP status")
    detail: str = Field(description="what failed, the value and the limit with unit, what to do")


class ProblemError(Exception):
    """Error raised by a route and returned as a problem."""

    def __init__(self, status: HTTPStatus, name: str, title: str, detail: str) -> None:
        super().__init__(detail)
        self.problem = Problem(type=f"urn:mrbench:problem:{name}", title=title, status=status, detail=detail)


def make_not_found(what: str, name: str) -> ProblemError:
    """Return the error for an object that does not exist."""
    return ProblemError(HTTPStatus.NOT_FOUND, "not-found", "Not found", f"there is no {what} {name}")


def make_unauthorised() -> ProblemError:
    """Return the error for a missing or wrong token."""
    detail = "give the token as `Authorization: Bearer ...`; `mrbench serve --new-token` creates a new one"
    return ProblemError(HTTPStatus.UNAUTHORIZED, "unauthorised", "The token is missing or wrong", detail)


def make_conflict(name: str, title: str, detail: str) -> ProblemError:
    """Return the error for a request that is not possible in the present state."""
    return ProblemError(HTTPStatus.CONFLICT, name, title, detail)


RESPONSES: dict[int | str, dict[str, Any]] = {
    status: {
        "description": description,
        "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}},
    }
    for status, description in (
        (401, "The token is missing or wrong"),
        (404, "The object does not exist"),
        (409, "Not possible in the present state"),
        (422, "The request is invalid"),
        (503, "The rig agent does not answer"),
    )
}
"""Error responses of every route."""

# The first matching class applies, so that the base class is last.
_BENCH_PROBLEMS: tuple[tuple[type[BenchError], HTTPStatus, str, str], ...] = (
    (MethodError, HTTPStatus.UNPROCESSABLE_ENTITY, "method-refused", "The method was refused"),
    (AgentUnreachableError, HTTPStatus.SERVICE_UNAVAILABLE, "agent-unreachable", "The rig agent does not answer"),
    (LogError, HTTPStatus.CONFLICT, "log-unusable", "The log cannot be used"),
    (BenchError, HTTPStatus.CONFLICT, "not-possible", "Not possible"),
)


def install_handlers(app: FastAPI) -> None:
    """Make an application return every error as a problem."""

    @app.exception_handler(ProblemError)
    async def _handle_problem(request: Request, error: ProblemError) -> JSONResponse:
        return _make_response(error.problem)

    @app.exception_handler(BenchError)
    async def _handle_bench_error(request: Request, error: BenchError) -> JSONResponse:
        status, name, title = next(kind[1:] for kind in _BENCH_PROBLEMS if isinstance(error, kind[0]))
        return _make_response(ProblemError(status, name, title, str(error)).problem)

    @app.exception_handler(RequestValidationError)
    async def _handle_invalid_request(request: Request, error: RequestValidationError) -> JSONResponse:
        return _make_response(_make_validation_problem(error))

    # Starlette's class, not FastAPI's: it is also raised for an unknown path.
    @app.exception_handler(HTTPException)
    async def _handle_http_error(request: Request, error: HTTPException) -> JSONResponse:
        status = HTTPStatus(error.status_code)
        name = status.phrase.lower().replace(" ", "-")
        problem = ProblemError(status, name, status.phrase, f"{request.method} {request.url.path}: {error.detail}")
        return _make_response(problem.problem, error.headers)

    @app.exception_handler(Exception)
    async def _handle_internal_error(request: Request, error: Exception) -> JSONResponse:
        _LOG.error("defect", exc_info=error, extra={"path": request.url.path})
        detail = "internal error of the service; its log contains the details, please report it"
        internal = ProblemError(HTTPStatus.INTERNAL_SERVER_ERROR, "defect", "Internal error", detail)
        return _make_response(internal.problem)


def _make_validation_problem(error: RequestValidationError) -> Problem:
    first = error.errors()[0]
    place = ".".join(str(step) for step in first["loc"])
    others = len(error.errors()) - 1
    more = f" (and {others} more)" if others else ""
    detail = f"{place}: {first['msg'].removeprefix('Value error, ')}{more}"
    return ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail).problem


def _make_response(problem: Problem, headers: Any = None) -> JSONResponse:
    return JSONResponse(problem.model_dump(), problem.status, headers=headers, media_type=MEDIA_TYPE)
