"""Base class of strict documents, and validation errors as messages for the author of a document."""

from collections.abc import Sequence
from typing import Annotated, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

MAX_SERIAL_LENGTH = 200
"""Largest number of characters of a serial number."""


def check_serial(serial: str) -> str:
    """Return the serial number of a specimen unchanged if it is usable.

    Raises:
        ValueError: it is empty or too long, or has control characters or spaces at its ends.
    """
    if not serial.strip():
        raise ValueError("the serial number of the specimen is empty; give that of the damper under test")
    if len(serial) > MAX_SERIAL_LENGTH:
        raise ValueError(f"the serial number has {len(serial)} characters; give at most {MAX_SERIAL_LENGTH}")
    if not serial.isprintable():
        raise ValueError("the serial number contains a control character; give letters, digits, marks and spaces")
    if serial != serial.strip():
        raise ValueError("the serial number begins or ends with a space; remove it")
    return serial


SerialNumber: TypeAlias = Annotated[
    str,
    AfterValidator(check_serial),
    Field(json_schema_extra={"minLength": 1, "maxLength": MAX_SERIAL_LENGTH}),
]
"""Serial number of a specimen, as requests give it."""


class FrozenModel(BaseModel):
    """Part of a document: immutable; unknown keys, NaN and infinity are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


def describe_validation_error(error: ValidationError, root: str = "the document") -> str:
    """Return the position and message of the first fault, and the number of further ones.

    Args:
        error: a failed validation.
        root: name of the position if the document as a whole is at fault.
    """
    first, message = get_first_error(error)
    return f"{format_position(first['loc'], root)}: {message}"


def get_first_error(error: ValidationError) -> tuple[ErrorDetails, str]:
    """Return the first fault and its message, which also counts the further ones."""
    faults = error.errors(include_url=False)
    return faults[0], describe_faults(faults)


def describe_faults(faults: Sequence[ErrorDetails]) -> str:
    """Return the message of the first fault and the number of further ones."""
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return f"{_describe_fault(faults[0])}{more}"


def format_position(position: Sequence[int | str], root: str = "the document") -> str:
    """Return a position in a document as text, its steps joined by dots."""
    return ".".join(map(str, position)) or root


def _describe_fault(fault: ErrorDetails) -> str:
    context = fault.get("ctx", {})
    match fault["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden":
            return "no such key; check its spelling"
        case "union_tag_invalid":
            discriminator = str(context["discriminator"]).strip("'")
            return f"{discriminator} {context['tag']!r} is none of {context['expected_tags']}"
        case _:
            return fault["msg"].removeprefix("Value error, ")
