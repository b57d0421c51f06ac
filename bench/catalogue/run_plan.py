"""Plan of a run in its log: the method, and the last checkpoint that was passed; read without the samples."""

from pathlib import Path
from typing import Any, NamedTuple

import orjson
from mcap.reader import make_reader

from bench.errors import LogError
from bench.log import DAMAGE_ERRORS, EVENT, check_complete, convert_file_errors

_METHOD_FILE = "method.json"
_CHECKPOINT_WORDS = "after segment "
"""Begin of the text of a checkpoint event, followed by the name of its segment."""


class RunPlan(NamedTuple):
    """Method of a run, and the place that the run reached in it."""

    method: Any | None
    """Document of the method; None if the log contains none, such as that of an import."""
    checkpoint: str
    """Last checkpoint that was passed; empty without one."""


def read_plan(path: Path) -> RunPlan:
    """Read the plan of a run.

    Raises:
        LogError: the file cannot be read, is not an MCAP file, or is truncated or damaged.
    """
    with convert_file_errors(path), path.open("rb") as file:
        check_complete(path, file)
        try:
            reader = make_reader(file)
            attached = {one.name: one.data for one in reader.iter_attachments()}
            events = [orjson.loads(message.data) for _, _, message in reader.iter_messages([EVENT])]
        except DAMAGE_ERRORS as error:
            raise LogError(f"{path}: the log is damaged ({error}); run `mrbench salvage {path}`") from error
    passed = [event["text"].removeprefix(_CHECKPOINT_WORDS) for event in events if event["kind"] == "checkpoint"]
    method = orjson.loads(attached[_METHOD_FILE]) if _METHOD_FILE in attached else None
    return RunPlan(method, passed[-1] if passed else "")
