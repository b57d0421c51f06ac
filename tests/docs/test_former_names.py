"""Former names of fields: only their own page uses them."""

import importlib
import re

from pydantic import AliasChoices, BaseModel

from tests.docs.test_words import list_files
from tests.support import blocks

PAGE = "docs/reference/former-names.md"
MODELS = (
    "bench.config",
    "identification.documents",
    "identification.pinn.common.settings",
    "sim_rig.scenario",
    "sim_rig.trial.cases",
    "sim_rig.trial.scoring.trial_report",
)
PRODUCT = {"bench", "identification", "sim_rig"}
RECORDS = ("docs/evidence/", "docs/decisions/")
"""Pages that keep the words of their time."""


def list_models(base):
    for model in base.__subclasses__():
        yield model
        yield from list_models(model)


def read_names():
    """Return the pairs of former and present names, and all present names."""
    for name in MODELS:
        importlib.import_module(name)
    models = [m for m in list_models(BaseModel) if m.__module__.partition(".")[0] in PRODUCT]
    fields = [(name, field.validation_alias) for model in models for name, field in model.model_fields.items()]
    renamed = [(name, alias) for name, alias in fields if isinstance(alias, AliasChoices)]
    pairs = {(former, name) for name, alias in renamed for former in alias.choices if former != name}
    return pairs, {name for name, _ in fields}


def test_no_page_uses_a_former_name():
    pairs, present = read_names()
    former = {name for name, _ in pairs} - present
    assert "witness" in former
    pages = [page for page in list_files("*.md") if page != PAGE and not page.startswith(RECORDS)]
    found = [
        f"{page}: {code}"
        for page in pages
        for code in re.findall(r"`([\w.\[\]]+)`", (blocks.ROOT / page).read_text("utf-8"))
        if code.rpartition(".")[2] in former
    ]
    assert len(pages) > 20
    assert not found
