"""The `mrbench` command: a thin dispatcher.

Each room declares its commands in the entry-point group ``mrbench.commands``; a command's module is imported
when it is called or listed, so no room is loaded for another's sake.
"""

import os
import sys
from importlib.metadata import EntryPoints, entry_points, version
from typing import Annotated

import typer

GROUP = "mrbench.commands"
_EXTRAS = {
    "numba": "identification",
    "threadpoolctl": "identification",
    "torch": "identification",
    "pyarrow": "export",
}
"""Packages that a small installation leaves out, and the extra that brings them."""


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mrbench {version('mrbench')}")
        raise typer.Exit


def _application(commands: EntryPoints) -> typer.Typer:
    """The command line with these commands; each is a plain function that typer reads."""
    app = typer.Typer(
        name="mrbench",
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["--help", "-h"]},
    )

    @app.callback()
    def _mrbench(
        version: Annotated[
            bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
        ] = False,
    ) -> None:
        """Test bench for magnetorheological dampers: records, identifies, diagnoses."""

    for command in sorted(commands, key=lambda entry: entry.name):
        app.command(command.name)(command.load())
    return app


def main(arguments: list[str] | None = None) -> None:
    """Run one command; exit 0 with the answer, 1 with one line on what could not be done, 2 on misuse.

    A room's own errors carry ``exit_code``; anything else is a defect and keeps its traceback.
    """
    # The matrices here are small: a second thread of the BLAS library spins more than it multiplies.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    words = sys.argv[1:] if arguments is None else arguments
    commands = entry_points(group=GROUP)
    # Loading all of them takes longer than most of them take: only the one that was called, if there is one.
    called = commands.select(name=words[0]) if words else commands
    try:
        _application(called or commands)(args=words, prog_name="mrbench")
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
