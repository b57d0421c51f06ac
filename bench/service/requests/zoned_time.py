"""Time of a query parameter."""

from typing import Annotated

from pydantic import AwareDatetime, BeforeValidator


def _refuse_number(value: object) -> object:
    """Return a value that is not a number.

    Pydantic takes a number for seconds or milliseconds since 1970, depending on its size. The description of the
    interface knows ISO 8601 only.

    Raises:
        ValueError: the value is a number.
    """
    try:
        float(str(value))
    except ValueError:
        return value
    raise ValueError("a number is not a time; use ISO 8601 with a zone, such as 2026-01-31T08:00:00Z")


ZonedTime = Annotated[AwareDatetime, BeforeValidator(_refuse_number)]
"""ISO 8601 with a zone."""
