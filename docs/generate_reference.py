"""Fills the generated parts of docs/reference from the code: commands, fields, parameters, effects.

``python docs/generate_reference.py`` rewrites what stands between ``<!-- generated: NAME -->`` and
``<!-- end -->`` in every page there; a test compares. All else in those pages is written by hand.
"""

import re
import types
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

import typer
from pydantic import BaseModel

from bench.recorder.messages import EVENT, SAMPLE, SEGMENT, message_schema
from identification.damper.coordinates import COORDINATES
from identification.damper.effects import EFFECTS
from identification.damper.parameters import PARAMETERS, Quantity
from identification.gap.documents import Diagnosis
from identification.results import Delay, Estimate, Fit, Prediction

FOLDER = Path(__file__).parent / "reference"
PART = re.compile(r"(<!-- generated: ([\w ]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def filled(page: str) -> str:
    """The page with every generated part as the code has it now."""
    return PART.sub(lambda found: f"{found[1]}\n{PARTS[found[2]]()}\n\n{found[3]}", page)


def commands() -> str:
    """Every command with its arguments and options."""
    app = typer.Typer()
    for entry in entry_points(group="mrbench.commands"):
        app.command(entry.name)(entry.load())
    app.callback()(lambda: None)
    group: Any = typer.main.get_command(app)
    return "\n\n".join(_command(name, command) for name, command in sorted(group.commands.items()))


def _command(name: str, command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]
    words = [_placeholder(p) for p in arguments]
    words += [f"{p.opts[0]}{_value(p)}" for p in options if p.required]
    words += [f"[{p.opts[0]}{_value(p)}]" for p in options if not p.required]
    rows = [(f"`{_placeholder(p)}`", p.help) for p in arguments]
    rows += [(f"`{p.opts[0]}{_value(p)}`", f"{p.help}{_default(p)}") for p in options]
    said = command.help.replace("\n\n", "\0").replace("\n", " ").replace("\0", "\n\n")
    usage = f"```text\nmrbench {name} {' '.join(words)}\n```"
    return f"## {name}\n\n{said}\n\n{usage}\n\n{table(('', ''), rows)}"


def _placeholder(parameter: Any) -> str:
    plain = str(parameter.metavar or parameter.name.upper()).rstrip(".")
    return f"{plain}..." if parameter.nargs == -1 else plain


def _value(parameter: Any) -> str:
    if getattr(parameter, "is_flag", False):
        return ""
    return f" {parameter.metavar or parameter.name.rstrip('_').rsplit('_')[-1].upper()}"


def _default(parameter: Any) -> str:
    shown = (
        not parameter.required and parameter.default not in (None, "", False) and not callable(parameter.default)
    )
    return f" By default `{parameter.default}`." if shown else ""


def quantities(of: Iterable[Quantity]) -> str:
    """Symbol, unit, bounds and meaning, of parameters or coordinates."""
    rows = ((f"`{q.symbol}`", q.unit_for("drive"), f"{q.low:g} … {q.high:g}", q.meaning) for q in of)
    return table(("", "unit", "bounds of the search", "meaning"), rows)


def effects() -> str:
    """Every effect with its place, its forms and their parameters."""
    parts = []
    for effect in EFFECTS.values():
        parts.append(f"## {effect.name}\n\nStage `{effect.stage}`: {effect.meaning}.")
        for form in effect.forms:
            parts.append(f"Form `{form.name}`, acts as `{form.acts}`:\n\n{quantities(form.parameters)}")
    return "\n\n".join(parts)


def messages() -> str:
    """The fields of every message of a log."""
    parts = []
    for topic in (SAMPLE, SEGMENT, EVENT):
        schema = message_schema(topic)
        fields = schema["properties"] | {
            name.strip("^$"): field for name, field in schema.get("patternProperties", {}).items()
        }
        must = schema["required"]
        rows = (
            (f"`{name}`", "always" if name in must else "where known", field["description"])
            for name, field in fields.items()
        )
        parts.append(f"### {topic}\n\n{schema['description']}\n\n{table(('field', '', ''), rows)}")
    return "\n\n".join(parts)


def fields(of: type[BaseModel]) -> str:
    """Every key of a document, those inside others with a dot between."""
    return table(("key", "holds", "meaning"), _rows(of, ""))


def _rows(of: type[BaseModel], before: str) -> Iterator[tuple[str, str, str]]:
    for name, field in of.model_fields.items():
        key, inner = f"{before}{field.alias or name}", _model_in(field.annotation)
        said = field.description or (inner.__doc__ or "").split("\n")[0] if inner else field.description or ""
        yield f"`{key}`", _holds(field.annotation), said
        if inner is not None and inner not in SHOWN_ONCE:
            yield from _rows(inner, f"{key}{_step(field.annotation)}")


SHOWN_ONCE = (Estimate, Delay)
"""Types that stand at many keys; the page shows their own keys in a table of their own."""
PLAIN = {float: "number", int: "whole number", str: "text", bool: "true or false", type(None): "null"}
"""Types in a reader's words."""


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for part in get_args(annotation) if (found := _model_in(part)) is not None), None)


def _step(annotation: Any) -> str:
    return {list: "[].", dict: ".NAME."}.get(get_origin(annotation), ".")


def _holds(annotation: Any) -> str:
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin in (Union, types.UnionType):
        return " or ".join(_holds(part) for part in inside)
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in inside)
    if origin is tuple:
        return "[lowest, highest]"
    if origin is list:
        return f"list of {_holds(inside[0])}"
    if origin is dict:
        return f"{_holds(inside[1])} by name"
    if annotation in SHOWN_ONCE:
        return f"[{annotation.__name__}](#{annotation.__name__.lower()})"
    return PLAIN.get(annotation, "object")


def table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = [heads, ("---",) * len(heads), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


PARTS: dict[str, Callable[[], str]] = {
    "commands": commands,
    "parameters": lambda: quantities(PARAMETERS),
    "coordinates": lambda: quantities(COORDINATES),
    "effects": effects,
    "messages": messages,
    "fit": lambda: fields(Fit),
    "prediction": lambda: fields(Prediction),
    "diagnosis": lambda: fields(Diagnosis),
    "estimate": lambda: fields(Estimate),
    "delay": lambda: fields(Delay),
}
"""What can stand between the marks, by its name."""


if __name__ == "__main__":
    for path in sorted(FOLDER.glob("*.md")):
        path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")
