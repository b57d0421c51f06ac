"""Errors as `application/problem+json` (RFC 9457), with a stable type for each kind and without traceback."""

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException

from bench.campaigns import CampaignDocumentError
from bench.catalogue import CatalogueUnavailableError
from bench.errors import AgentUnreachableError, BenchError, LogError, MethodError, NoRigError, RecordingError
from bench.log_store import LogStoreUnavailableError
from bench.people import Right, find_roles
from bench.service.access import Identity

MEDIA_TYPE = "application/problem+json"
_LOG = logging.getLogger(__name__)


CLOSE = {"Connection": "close"}
"""Header that ends a connection on which an unread body may follow."""
MAX_QUOTE = 80
"""Largest number of characters that an error quotes from a name in a request."""
MAX_DETAIL = 2000
"""Largest number of characters of an error's text; errors of other packages may quote a request, too."""


class Problem(BaseModel):
    """Error of a request."""

    type: str = Field(description="`urn:mrbench:problem:NAME` with a stable name, for programs")
    title: str = Field(description="kind of error, for a person")
    status: int = Field(description="HTTP status")
    detail: str = Field(description="what failed, the value and the limit with unit, what to do")


class ProblemError(Exception):
    """Error raised by a route and returned as a problem."""

    def __init__(
        self,
        status: HTTPStatus,
        name: str,
        title: str,
        detail: str,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        detail = shorten(detail, MAX_DETAIL)
        super().__init__(detail)
        self.problem = Problem(type=f"urn:mrbench:problem:{name}", title=title, status=status, detail=detail)
        self.headers = headers


class BodyTooLargeError(HTTPException):
    """Error raised while a body is read; the framework passes only errors of this base class on."""

    def __init__(self, limit: int) -> None:
        super().__init__(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        self.limit = limit


def shorten(text: str, length: int = MAX_QUOTE) -> str:
    """Return a text, or its beginning with its number of characters if it is too long."""
    return text if len(text) <= length else f"{text[:length]}… ({len(text)} characters)"


def make_not_found(what: str, name: str) -> ProblemError:
    """Return the error for an object that does not exist; a long name is quoted in part."""
    return ProblemError(HTTPStatus.NOT_FOUND, "not-found", "Not found", f"there is no {what} {shorten(name)}")


def make_too_large(limit: int) -> ProblemError:
    """Return the error for a body above a limit [bytes]."""
    detail = f"the body exceeds {limit} bytes, the largest size of this request; send a shorter one"
    return ProblemError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "too-large", "The request is too large", detail)


def make_unauthorised() -> ProblemError:
    """Return the error for a request without sign-in."""
    detail = (
        "sign in on the page, or give a token as `Authorization: Bearer ...`; `mrbench serve --new-token` "
        "creates a new one of the bench"
    )
    return ProblemError(HTTPStatus.UNAUTHORIZED, "unauthorised", "Not signed in", detail)


def make_csrf_missing() -> ProblemError:
    """Return the error for a request that has the cookie of a session, but may come from another site."""
    detail = "the request has a session's cookie; send the `csrf` value of GET /session as X-CSRF-Token with it"
    return ProblemError(HTTPStatus.FORBIDDEN, "csrf", "The request may come from another site", detail)


def make_right_missing(right: Right, identity: Identity) -> ProblemError:
    """Return the error for a request that its sender has no right to."""
    roles = " or ".join(find_roles(right))
    detail = f"{identity.full_name} ({identity.role}) lacks the right {right}, which the role {roles} has"
    return ProblemError(HTTPStatus.FORBIDDEN, "right-missing", "Not permitted", f"{detail}; ask an administrator")


def make_conflict(name: str, title: str, detail: str) -> ProblemError:
    """Return the error for a request that is not possible in the present state."""
    return ProblemError(HTTPStatus.CONFLICT, name, title, detail)


def make_bench_problem(error: BenchError) -> ProblemError:
    """Return an error of the bench as a problem."""
    status, name, title = next(kind[1:] for kind in _BENCH_PROBLEMS if isinstance(error, kind[0]))
    return ProblemError(status, name, title, str(error))


RESPONSES: dict[int | str, dict[str, Any]] = {
    status: {
        "description": description,
        "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}},
    }
    for status, description in (
        (400, "The request cannot be read"),
        (401, "Not signed in"),
        (403, "Not permitted"),
        (404, "The object does not exist"),
        (409, "Not possible in the present state"),
        (413, "The body is too large"),
        (422, "The request is invalid"),
        (503, "The rig agent, the catalogue or the log store does not answer"),
    )
}
"""Error responses of every route."""

_HTTP_NAMES = {
    HTTPStatus.BAD_REQUEST: "bad-request",
    HTTPStatus.NOT_FOUND: "not-found",
    HTTPStatus.METHOD_NOT_ALLOWED: "method-not-allowed",
    HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE: "range-not-satisfiable",
}
"""Names of the errors that the framework raises; its own phrases differ between versions of Python."""

# The first matching class applies, so that the base class is last.
_BENCH_PROBLEMS: tuple[tuple[type[BenchError], HTTPStatus, str, str], ...] = (
    (MethodError, HTTPStatus.UNPROCESSABLE_ENTITY, "method-refused", "The method was refused"),
    (RecordingError, HTTPStatus.UNPROCESSABLE_ENTITY, "recording-refused", "The recording was refused"),
    (NoRigError, HTTPStatus.NOT_FOUND, "no-rig", "No rig is configured"),
    (
        CampaignDocumentError,
        HTTPStatus.UNPROCESSABLE_ENTITY,
        "campaign-refused",
        "The campaign was refused",
    ),
    (AgentUnreachableError, HTTPStatus.SERVICE_UNAVAILABLE, "agent-unreachable", "The rig agent does not answer"),
    (
        CatalogueUnavailableError,
        HTTPStatus.SERVICE_UNAVAILABLE,
        "catalogue-unavailable",
        "The catalogue cannot be used at present",
    ),
    (
        LogStoreUnavailableError,
        HTTPStatus.SERVICE_UNAVAILABLE,
        "log-store-unavailable",
        "The log store cannot be used at present",
    ),
    (LogError, HTTPStatus.CONFLICT, "log-unusable", "The log cannot be used"),
    (BenchError, HTTPStatus.CONFLICT, "not-possible", "Not possible"),
)


def install_handlers(app: FastAPI) -> None:
    """Make an application return every error as a problem."""

    @app.exception_handler(ProblemError)
    async def _handle_problem(request: Request, error: ProblemError) -> JSONResponse:
        return make_response(error)

    @app.exception_handler(BenchError)
    async def _handle_bench_error(request: Request, error: BenchError) -> JSONResponse:
        return make_response(make_bench_problem(error))

    @app.exception_handler(RequestValidationError)
    async def _handle_invalid_request(request: Request, error: RequestValidationError) -> JSONResponse:
        return make_response(_make_validation_problem(error))

    @app.exception_handler(BodyTooLargeError)
    async def _handle_large_body(request: Request, error: BodyTooLargeError) -> JSONResponse:
        return make_response(make_too_large(error.limit), CLOSE)

    # Starlette's class, not FastAPI's: it is also raised for an unknown path.
    @app.exception_handler(HTTPException)
    async def _handle_http_error(request: Request, error: HTTPException) -> JSONResponse:
        status = HTTPStatus(error.status_code)
        name = _HTTP_NAMES.get(status, "http-error")
        path = shorten(request.url.path)
        problem = ProblemError(status, name, status.phrase, f"{request.method} {path}: {error.detail}")
        return make_response(problem, error.headers)

    @app.exception_handler(Exception)
    async def _handle_internal_error(request: Request, error: Exception) -> JSONResponse:
        _LOG.error("defect", exc_info=error, extra={"path": request.url.path})
        detail = "internal error of the service; its log contains the details, please report it"
        internal = ProblemError(HTTPStatus.INTERNAL_SERVER_ERROR, "defect", "Internal error", detail)
        return make_response(internal)


def _make_validation_problem(error: RequestValidationError) -> ProblemError:
    first = error.errors()[0]
    place = shorten(".".join(str(step) for step in first["loc"]))
    others = len(error.errors()) - 1
    more = f" (and {others} more)" if others else ""
    detail = f"{place}: {first['msg'].removeprefix('Value error, ')}{more}"
    return ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail)


def make_response(error: ProblemError, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """Return the response for an error."""
    problem = error.problem
    return JSONResponse(
        problem.model_dump(), problem.status, headers=headers or error.headers, media_type=MEDIA_TYPE
    )
