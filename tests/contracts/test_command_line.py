"""Help, exit codes and one-line error messages that all commands have in common."""

import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

MRBENCH = Path(sys.executable).parent / "mrbench"
COMMANDS = sorted(entry.name for entry in entry_points(group="mrbench.commands"))
HEAVY = ("fastapi", "matplotlib", "numba", "numpy", "pydantic", "scipy", "torch")


def mrbench(*words, folder):
    return subprocess.run([MRBENCH, *words], cwd=folder, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize(
    "words", [(), *((command,) for command in COMMANDS)], ids=lambda w: " ".join(w) or "mrbench"
)
def test_a_command_has_help(words, tmp_path):
    done = mrbench(*words, "--help", folder=tmp_path)
    assert done.returncode == 0
    assert len(done.stdout) > 80
    assert done.stderr == ""


def test_help_lists_all_commands_with_descriptions(tmp_path):
    listed = mrbench("--help", folder=tmp_path).stdout.partition("Commands:")[2].splitlines()
    assert [line.split()[0] for line in listed if line.strip()] == COMMANDS
    assert all(len(line.split()) > 3 for line in listed if line.strip())
    assert not [line for line in listed if line.endswith("...")], "a description is cut off"


def test_help_imports_no_heavy_package():
    words = f"""if True:
        import contextlib, io, sys
        from bench.cli import main
        with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()) as output:
            main(["--help"])
        assert "Commands:" in output.getvalue()
        print([name for name in {HEAVY!r} if name in sys.modules])
    """
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "[]"


def test_the_version_is_printed(tmp_path):
    assert mrbench("--version", folder=tmp_path).stdout.startswith("mrbench ")


@pytest.mark.parametrize(
    "words",
    [
        ("nonsense",),
        ("demo", "--nonsense"),
        ("export", "run.mcap"),
        ("export", "run.mcap", "--format", "xml"),
        ("identify",),
        ("identify", "run.mcap", "--out", "fit.json", "--hold-out-after", "2"),
        ("import", "a.csv", "--out", "run.mcap", "--column", "force"),
        ("import", "a.csv", "--out", "run.mcap", "--drive-kind", "hand"),
        ("import", "a.csv", "--out", "run.mcap", "--unit", "mm"),
        ("predict", "fit.json"),
        ("report", "run.mcap"),
        ("report", "run.mcap", "--out", "-"),
        ("run", "quick"),
        ("run", "quick", "--scenario", "default", "--out", "-"),
        ("salvage",),
    ],
    ids=" ".join,
)
def test_misuse_ends_with_2_and_writes_nothing(words, tmp_path):
    done = mrbench(*words, folder=tmp_path)
    assert done.returncode == 2
    assert "Error" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("export", "run.mcap", "--format", "csv"), "run.mcap"),
        (("identify", "run.mcap", "--out", "fit.json"), "run.mcap"),
        (("identify", "run.mcap", "--out", "fit.json", "--stages", "guess"), "guess"),
        (("import", "a.csv", "--out", "run.mcap"), "a.csv"),
        (("predict", "fit.json", "run.mcap", "--out", "-"), "fit.json"),
        (("report", "run.mcap", "--out", "report.html"), "run.mcap"),
        (("run", "nonsense", "--scenario", "default"), "nonsense"),
        (("run", "nonsense", "--dry-run"), "nonsense"),
        (("run", "quick", "--scenario", "nonsense"), "nonsense"),
        (("salvage", "run.mcap"), "run.mcap"),
        (("serve", "--config", "bench.toml"), "bench.toml"),
        (("sim", "--scenario", "nonsense"), "nonsense"),
        (("worker", "--scheduler", "nonsense"), "nonsense"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_a_failure_ends_with_1_and_one_line_that_names_the_cause(words, named, tmp_path):
    done = mrbench(*words, folder=tmp_path)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("mrbench: ")
    assert named in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []
