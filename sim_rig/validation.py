"""Base of every document of the simulated rig, and the text of a validation error."""

from pydantic import BaseModel, ConfigDict, ValidationError

_ERROR_TEXTS = {"missing": "is missing", "extra_forbidden": "there is no such key"}


class FrozenModel(BaseModel):
    """A part of a document: immutable; unknown keys, NaN and infinity are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


def describe_first_error(error: ValidationError) -> str:
    """Return position and description of the first error in a document, in one line."""
    faults = error.errors(include_url=False)
    # Where a name or an object is allowed, an error inside the object is more precise than "not a string".
    first = next((fault for fault in faults if fault["type"] != "string_type"), faults[0])
    place = ".".join(str(part) for part in first["loc"]) or "document"
    return f"{place}: {_ERROR_TEXTS.get(first['type'], first['msg'].removeprefix('Value error, '))}"
