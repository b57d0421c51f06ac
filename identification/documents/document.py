"""Base class of all documents."""

from pydantic import ConfigDict

from identification.validation import FrozenModel


class Document(FrozenModel):
    """A JSON document or a part of one.

    A renamed field has ``validation_alias=AliasChoices(new, old)``: the new name is written, both are read.
    """

    model_config = ConfigDict(populate_by_name=True)
