"""The `mrbench` command: a dispatcher.

Each package declares its commands in the entry-point group ``mrbench.commands``. A command's module is imported
only if the command is called or listed, so that no command waits for the imports of another.
"""

import os
import sys
from importlib.metadata import EntryPoints, entry_points, version
from typing import Annotated

import typer

from bench.planned_strokes import accept_methods

GROUP = "mrbench.commands"
_EXTRAS = {
    "numba": "identification",
    "threadpoolctl": "identification",
    "torch": "identification",
    "pyarrow": "export",
}
"""Extra that installs each package which a minimal installation lacks."""


def _show_version(requested: bool) -> None:
    if requested:
        typer.echo(f"mrbench {version('mrbench')}")
        raise typer.Exit


def _mrbench(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Test bench for magnetorheological dampers: records, identifies, diagnoses.

    With recordings: import, identify, diagnose, report. Without: demo. With a rig: rig, prepare, run, serve.
    """


def _make_application(commands: EntryPoints) -> typer.Typer:
    """Return the command line with these commands; each is a plain function that typer reads."""
    app = typer.Typer(
        name="mrbench",
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["--help", "-h"]},
    )
    app.callback()(_mrbench)
    for command in sorted(commands, key=lambda entry: entry.name):
        app.command(command.name)(accept_methods(command.name, command.load()))
    return app


def main(arguments: list[str] | None = None) -> None:
    """Run one command: exit 0 on success, 1 with a one-line error message, 2 on misuse.

    Expected errors carry ``exit_code``. Any other exception is an internal error and keeps its traceback.
    """
    # The matrices are small: a second thread of the BLAS library costs more time than it saves.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    arguments = sys.argv[1:] if arguments is None else arguments
    commands = entry_points(group=GROUP)
    # Loading all commands takes longer than most of them run, so only the called one is loaded.
    called = commands.select(name=arguments[0]) if arguments else commands
    try:
        _make_application(called or commands)(args=arguments, prog_name="mrbench")
    except ModuleNotFoundError as error:
        if error.name not in _EXTRAS:
            raise
        typer.echo(
            f"mrbench: {error.name} is not installed; pip install 'mrbench[{_EXTRAS[error.name]}]'", err=True
        )
        sys.exit(1)
    except Exception as error:
        code: int | None = getattr(error, "exit_code", None)
        if code is None:
            raise
        typer.echo(f"mrbench: {error}", err=True)
        sys.exit(code)


if __name__ == "__main__":
    main()
