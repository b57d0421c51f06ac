"""Commands of other packages take a method by name: the dispatcher compiles it to a file of planned strokes."""

import inspect
import json
from pathlib import Path

import numpy as np
import pytest

from bench.errors import MethodError
from bench.planned_strokes import accept_methods, compile_argument

COPY = Path(__file__).parents[3] / "bench" / "methods" / "library" / "quick.json"


def predict(model: Path, log: str, free: str = "") -> tuple[Path, str, str]:
    """Return the arguments; planned strokes as their method."""
    if log.endswith(".npz") and Path(log).is_file():
        with np.load(log) as file:
            return model, json.loads(str(file["info"]))["method"], free
    return model, log, free


@pytest.mark.parametrize("method", ["quick", str(COPY)], ids=["shipped", "file"])
def test_a_method_is_compiled_and_handed_on_as_planned_strokes(method):
    arguments = {"model": Path("fit.json"), "log": method, "free": "offset"}
    assert accept_methods("predict", predict)(**arguments) == (Path("fit.json"), "quick", "offset")


@pytest.mark.parametrize("log", ["run.mcap", "planned.npz"])
def test_logs_and_planned_strokes_are_passed_on_unchanged(log):
    assert accept_methods("predict", predict)(model=Path("fit.json"), log=log) == (Path("fit.json"), log, "")


def test_a_log_of_another_name_is_passed_on_unchanged(tmp_path):
    log = tmp_path / "run.log"
    log.write_bytes(b"log")
    with compile_argument(str(log)) as value:
        assert value == str(log)


def test_the_file_of_planned_strokes_is_removed_afterwards():
    with compile_argument("quick") as planned:
        assert Path(planned).is_file()
    assert not Path(planned).exists()


def test_a_name_that_is_neither_log_nor_method_is_refused():
    with pytest.raises(MethodError, match=r"nonsense is not a log \(\.mcap\), and as a method: .*quick"):
        accept_methods("predict", predict)(model=Path("fit.json"), log="nonsense")


def test_other_commands_and_the_options_of_a_command_stay_as_they_are():
    assert accept_methods("identify", predict) is predict
    assert inspect.signature(accept_methods("predict", predict)) == inspect.signature(predict)
