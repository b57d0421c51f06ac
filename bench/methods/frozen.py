"""The ground of every document of the bench: immutable, nothing unknown taken in, nothing infinite."""

from pydantic import BaseModel, ConfigDict


class Frozen(BaseModel):
    """A part of a document: immutable; unknown keys, NaN and infinity are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)
