"""Conditional requests: 304 for a body that the client has, 412 for a change of what was changed meanwhile.

The tag of a changeable object has two parts, ``"REVISION-HASH"``. The hash is that of the whole body. A job or the
progress of a run changes it, so that 304 never stands for another body. The revision counts the changes by people.
`If-Match` compares only the revision, so that a job that ends meanwhile refuses no change of a tag.
"""

import hashlib
from http import HTTPStatus
from typing import Annotated, Any

from fastapi import Header, Response
from pydantic import BaseModel

from bench.service.problems import MEDIA_TYPE

_HASH_LENGTH = 32
"""Number of hexadecimal digits of a hash in a tag: 128 bits."""
_PROBLEM = {"content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}}

NOT_MODIFIED: dict[int | str, dict[str, Any]] = {
    304: {"description": "The client has this content: `If-None-Match` contains its `ETag`"}
}
"""Response of the routes that check `If-None-Match`, for OpenAPI."""
PRECONDITIONS: dict[int | str, dict[str, Any]] = {
    412: {"description": "The object was changed meanwhile", **_PROBLEM},
    428: {"description": "The header If-Match is missing", **_PROBLEM},
}
"""Responses of the routes that need `If-Match`, for OpenAPI."""

KnownTags = Annotated[
    str | None, Header(alias="If-None-Match", description="`ETag` of the answer that the client has; then 304")
]
"""Parameter of a route: tags of the contents that the client has."""
ExpectedTag = Annotated[
    str | None, Header(alias="If-Match", description="`ETag` of what was read; of it only the revision counts")
]
"""Parameter of a route: tag of the object as the client has read it."""


def make_tag(view: BaseModel, revision: int) -> str:
    """Return the tag of a body, with the number of the changes by people."""
    digest = hashlib.sha256(view.model_dump_json(by_alias=True).encode()).hexdigest()
    return f'"{revision}-{digest[:_HASH_LENGTH]}"'


def is_known(known: str | None, tag: str) -> bool:
    """Return whether the tags of `If-None-Match`, or `*`, contain the tag of the present content."""
    tags = _split(known)
    return "*" in tags or tag in tags


def is_expected(expected: str, revision: int) -> bool:
    """Return whether the tags of `If-Match`, or `*`, contain one with the present revision."""
    revisions = [tag.strip('"').partition("-")[0] for tag in _split(expected)]
    return "*" in revisions or str(revision) in revisions


def send_unless_known(view: BaseModel, tag: str, known: str | None, *, exclude_defaults: bool = False) -> Response:
    """Return a view as JSON under its tag, or 304 without a body if the client has it.

    Args:
        view: content of the answer.
        tag: its tag, in quotation marks.
        known: header `If-None-Match`; None without one.
        exclude_defaults: leave out fields with their default values.
    """
    if is_known(known, tag):
        return make_not_modified(tag)
    body = view.model_dump_json(by_alias=True, exclude_defaults=exclude_defaults)
    return Response(body, headers={"ETag": tag}, media_type="application/json")


def make_not_modified(tag: str) -> Response:
    """Return the answer 304 for the content under a tag."""
    return Response(status_code=HTTPStatus.NOT_MODIFIED, headers={"ETag": tag})


def _split(tags: str | None) -> list[str]:
    return [one.strip().removeprefix("W/") for one in (tags or "").split(",")]
