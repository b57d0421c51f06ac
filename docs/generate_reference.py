"""Generator of the reference: JSON Schemas, OpenAPI description, and tables in the pages.

``python docs/generate_reference.py`` writes all files of `docs/reference` that follow from the code. These are one
JSON Schema for each document and log message, the OpenAPI description of the REST interface, and in the pages
everything between ``<!-- generated: NAME -->`` and ``<!-- end -->``. Tests compare the files with `make_files`.
"""

import json
import re
import types
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

import typer
from pydantic import AliasChoices, BaseModel

from bench.calibration import Certificate
from bench.campaigns import Campaign, CampaignPlan
from bench.config import BenchConfig
from bench.log import MESSAGES, TOPIC_FAMILIES, make_message_schema
from bench.methods import Envelope, Method
from bench.oidc import OidcConfig
from bench.service.application import create_app
from identification.damper import COORDINATES, PARAMETERS, Quantity
from identification.damper.definitions import STAGE_OF, VARIABLES_AT, EffectFile
from identification.damper.effects import EFFECTS
from identification.documents import (
    Delay,
    DesignReport,
    Diagnosis,
    Estimate,
    Fit,
    Forecast,
    Prediction,
    Trend,
    Twin,
)
from identification.pinn.common import DenseSettings, ElementSettings
from sim_rig.hidden_effect import Truth
from sim_rig.scenario import Scenario
from sim_rig.trial.cases import Seal, SealedTruth
from sim_rig.trial.scoring import TrialReport

FOLDER = Path(__file__).parent / "reference"

DOCUMENTS: dict[str, type[BaseModel]] = {
    "bench": BenchConfig,
    "campaign": Campaign,
    "campaign-plan": CampaignPlan,
    "certificate": Certificate,
    "diagnosis": Diagnosis,
    "effect": EffectFile,
    "envelope": Envelope,
    "fit": Fit,
    "forecast": Forecast,
    "foresight": DesignReport,
    "method": Method,
    "oidc": OidcConfig,
    "prediction": Prediction,
    "scenario": Scenario,
    "trend": Trend,
    "trial": TrialReport,
    "truth": Truth,
}
"""Type of each document by the name of its schema file."""

OTHER_FILES: dict[str, type[BaseModel]] = {
    "twin": Twin,
    "network preset `elements`": ElementSettings,
    "network preset `dense`": DenseSettings,
    "head of a trial": Seal,
    "sealed truth of a trial": SealedTruth,
}
"""Type of each file without a schema file of its own, by its name."""

LOG_MESSAGES: dict[str, str] = {
    model.__name__.lower(): topic for topic, model in {**MESSAGES, **TOPIC_FAMILIES}.items()
}
"""Topic or topic prefix of each log message by the name of its schema file."""

_GENERATED_PART = re.compile(r"(<!-- generated: ([\w ]+) -->\n).*?(<!-- end -->)", re.DOTALL)
_REPEATED_TYPES = (Estimate, Delay)
"""Types of many keys, whose own keys are listed once in a separate table."""
_TYPE_NAMES = {float: "number", int: "whole number", str: "text", bool: "true or false", type(None): "null"}


def make_files() -> dict[Path, str]:
    """Return the text of every generated file; pages contain hand-written parts as well."""
    schemas = {FOLDER / "schemas" / f"{name}.json": make_schema(name) for name in (*DOCUMENTS, *LOG_MESSAGES)}
    pages = {path: fill_page(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.md"))}
    return {**schemas, FOLDER / "openapi.json": _format_json(create_app().openapi()), **pages}


def make_schema(name: str) -> str:
    """Return the JSON Schema of a document or log message as text."""
    if name in LOG_MESSAGES:
        return _format_json(make_message_schema(LOG_MESSAGES[name]))
    schema = DOCUMENTS[name].model_json_schema(by_alias=True)
    return _format_json({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema})


def _format_json(content: dict[str, Any]) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def fill_page(page: str) -> str:
    """Return a page with its generated parts made from the code."""
    return _GENERATED_PART.sub(lambda match: f"{match[1]}\n{PARTS[match[2]]()}\n\n{match[3]}", page)


def describe_commands() -> str:
    """Describe every command with its arguments and options."""
    app = typer.Typer()
    for entry in entry_points(group="mrbench.commands"):
        app.command(entry.name)(entry.load())
    app.callback()(lambda: None)
    group: Any = typer.main.get_command(app)
    return "\n\n".join(_describe_command(name, command) for name, command in sorted(group.commands.items()))


def _describe_command(name: str, command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and p.name != "help" and not p.hidden]
    usage = [_format_argument(p) for p in arguments]
    usage += [f"{p.opts[0]}{_format_value(p)}" for p in options if p.required]
    usage += [f"[{p.opts[0]}{_format_value(p)}]" for p in options if not p.required]
    rows = [(f"`{_format_argument(p)}`", p.help) for p in arguments]
    rows += [(f"`{p.opts[0]}{_format_value(p)}`", f"{p.help}{_format_default(p)}") for p in options]
    text = command.help.replace("\n\n", "\0").replace("\n", " ").replace("\0", "\n\n")
    block = f"```text\nmrbench {name} {' '.join(usage)}\n```"
    return f"## {name}\n\n{text}\n\n{block}\n\n{make_table(('', ''), rows)}"


def _format_argument(parameter: Any) -> str:
    text = str(parameter.metavar or parameter.name.upper()).rstrip(".")
    return f"{text}..." if parameter.nargs == -1 else text


def _format_value(parameter: Any) -> str:
    if getattr(parameter, "is_flag", False):
        return ""
    return f" {parameter.metavar or parameter.name.rstrip('_').rsplit('_')[-1].upper()}"


def _format_default(parameter: Any) -> str:
    default = parameter.default
    has_default = not parameter.required and default not in (None, "", False) and not callable(default)
    return f" By default `{default}`." if has_default else ""


def describe_quantities(quantities: Iterable[Quantity], bounds: str = "bounds of the search") -> str:
    """Describe parameters or coordinates by symbol, unit, bounds and meaning."""
    rows = ((f"`{q.symbol}`", q.format_unit("drive"), f"{q.low:g} … {q.high:g}", q.meaning) for q in quantities)
    return make_table(("", "unit", bounds, "meaning"), rows)


def describe_effects() -> str:
    """Describe every effect with its stage, its forms and their parameters."""
    parts = []
    for effect in EFFECTS.values():
        parts.append(
            f"## {effect.name}\n\nStage `{effect.stage}`, variable `{effect.variable}`: {effect.meaning}."
        )
        for form in effect.forms:
            table = describe_quantities(form.parameters)
            parts.append(f"Form `{form.name}`, acts as `{form.action}`:\n\n{table}")
    return "\n\n".join(parts)


def describe_effect_places() -> str:
    """Describe every place of an effect file with its stage and its variables."""
    rows = (
        (f"`{place}`", f"`{STAGE_OF[place]}`", ", ".join(f"`{variable}`" for variable in variables))
        for place, variables in VARIABLES_AT.items()
    )
    return make_table(("place", "stage", "variables"), rows)


def describe_messages() -> str:
    """Describe the fields of the messages that every log has."""
    parts = []
    for topic in MESSAGES:
        schema = make_message_schema(topic)
        nullable = {name.strip("^$"): field for name, field in schema.get("patternProperties", {}).items()}
        rows = (
            (f"`{name}`", "always" if name in schema["required"] else "if known", field["description"])
            for name, field in (schema["properties"] | nullable).items()
        )
        parts.append(f"### {topic}\n\n{schema['description']}\n\n{make_table(('field', '', ''), rows)}")
    return "\n\n".join(parts)


def describe_fields(model: type[BaseModel]) -> str:
    """Describe every key of a document; keys of nested objects are separated by dots."""
    return make_table(("key", "holds", "meaning"), _make_field_rows(model, ""))


def _make_field_rows(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, str, str]]:
    for name, field in model.model_fields.items():
        key, inner = f"{prefix}{field.alias or name}", _find_model(field.annotation)
        inner_text = (inner.__doc__ or "").split("\n")[0] if inner else ""
        yield f"`{key}`", _format_type(field.annotation), field.description or inner_text
        if inner is not None and inner not in _REPEATED_TYPES:
            yield from _make_field_rows(inner, f"{key}{_format_separator(field.annotation)}")


def describe_former_names() -> str:
    """Describe every renamed field of a document or settings file."""
    files = {**DOCUMENTS, **OTHER_FILES}
    rows = dict.fromkeys((name, *row) for name in sorted(files) for row in _make_former_rows(files[name], ""))
    return make_table(("file", "former", "present"), rows)


def _make_former_rows(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, str]]:
    for name, field in model.model_fields.items():
        aliases = field.validation_alias
        for former in aliases.choices if isinstance(aliases, AliasChoices) else ():
            if former != name:
                yield f"`{prefix}{former}`", f"`{name}`"
        for inner in _find_models(field.annotation):
            yield from _make_former_rows(inner, f"{prefix}{name}{_format_separator(field.annotation)}")


def _find_model(annotation: Any) -> type[BaseModel] | None:
    return next(_find_models(annotation), None)


def _find_models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _find_models(part)


def _format_separator(annotation: Any) -> str:
    return {list: "[].", tuple: "[].", dict: ".NAME."}.get(get_origin(annotation), ".")


def _format_type(annotation: Any) -> str:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, types.UnionType):
        return " or ".join(_format_type(part) for part in arguments)
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in arguments)
    if origin is tuple:
        return "[lowest, highest]"
    if origin is list:
        return f"list of {_format_type(arguments[0])}"
    if origin is dict:
        return f"{_format_type(arguments[1])} by name"
    if annotation in _REPEATED_TYPES:
        return f"[{annotation.__name__}](#{annotation.__name__.lower()})"
    return _TYPE_NAMES.get(annotation, "object")


def make_table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a Markdown table."""
    lines = [heads, ("---",) * len(heads), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


PARTS: dict[str, Callable[[], str]] = {
    "commands": describe_commands,
    "parameters": lambda: describe_quantities(PARAMETERS, "accepted values"),
    "coordinates": lambda: describe_quantities(COORDINATES, "accepted values"),
    "effects": describe_effects,
    "messages": describe_messages,
    "fit": lambda: describe_fields(Fit),
    "prediction": lambda: describe_fields(Prediction),
    "diagnosis": lambda: describe_fields(Diagnosis),
    "effect file": lambda: describe_fields(EffectFile),
    "effect places": describe_effect_places,
    "estimate": lambda: describe_fields(Estimate),
    "delay": lambda: describe_fields(Delay),
    "former names": describe_former_names,
}
"""Function that makes each generated part of a page."""


if __name__ == "__main__":
    for path, text in make_files().items():
        path.write_text(text, encoding="utf-8")
