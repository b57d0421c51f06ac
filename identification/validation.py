"""Base of frozen models, and validation errors as one line of text."""

from pydantic import BaseModel, ConfigDict, ValidationError


class FrozenModel(BaseModel):
    """Immutable model that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def describe_validation_error(error: ValidationError, root: str = "the file") -> str:
    """Return location and message of the first error; ``root`` names a location that is the whole document."""
    first = error.errors()[0]
    location = ".".join(str(part) for part in first["loc"]) or root
    return f"{location}: {first['msg'][:80]}"
