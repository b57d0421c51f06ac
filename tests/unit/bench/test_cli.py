"""Dispatcher: exit codes and messages on the command line."""

from importlib.metadata import EntryPoint, EntryPoints

import pytest

import bench.cli
from bench.cli import main
from bench.errors import RunError


def refuse() -> None:
    """Refuse."""
    raise RunError("load cell: 31.2 kN exceeds 25 kN; lower the stroke")


def lack() -> None:
    """Lack a package."""
    raise ModuleNotFoundError("No module named 'numba'", name="numba")


def break_down() -> None:
    """Break down."""
    raise ZeroDivisionError("internal error")


@pytest.fixture(autouse=True)
def commands(monkeypatch):
    entries = EntryPoints(
        EntryPoint(name, f"{__name__}:{function.__name__}", bench.cli.GROUP)
        for name, function in (("refuse", refuse), ("lack", lack), ("break", break_down))
    )
    monkeypatch.setattr(bench.cli, "entry_points", lambda group: entries)


def ending(*words: str) -> int | str | None:
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return ended.value.code


def test_an_expected_error_is_one_line_and_exit_1(capsys):
    assert ending("refuse") == 1
    assert capsys.readouterr().err == "mrbench: load cell: 31.2 kN exceeds 25 kN; lower the stroke\n"


def test_a_missing_extra_is_named(capsys):
    assert ending("lack") == 1
    assert "pip install 'mrbench[identification]'" in capsys.readouterr().err


def test_an_internal_error_keeps_its_traceback():
    with pytest.raises(ZeroDivisionError):
        main(["break"])


def test_misuse_is_exit_2(capsys):
    assert ending("refuse", "--no-such-option") == 2
    assert "no-such-option" in capsys.readouterr().err


def test_help_lists_every_command(capsys):
    assert ending("--help") == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in ("refuse", "lack", "break"))


def test_the_version_is_shown(capsys):
    assert ending("--version") == 0
    assert capsys.readouterr().out.startswith("mrbench ")
