"""Methods given to commands of other packages, which read planned strokes from a file.

Only the bench compiles methods. Where a person names a method, the dispatcher compiles it to a temporary file of
planned strokes and passes that file to the command. So no other package has to start the bench.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

_METHOD_PARAMETERS = {"predict": "log"}
"""Parameter in which a command takes a log, planned strokes or a method, by the command's name."""


def accept_methods(name: str, command: Callable[..., Any]) -> Callable[..., Any]:
    """Return the command of a name, with methods replaced by planned strokes where it takes them."""
    parameter = _METHOD_PARAMETERS.get(name)
    if parameter is None:
        return command

    @wraps(command)
    def call_with_strokes(**arguments: Any) -> Any:
        with compile_argument(arguments[parameter]) as value:
            return command(**{**arguments, parameter: value})

    return call_with_strokes


@contextmanager
def compile_argument(argument: str) -> Iterator[str]:
    """Provide the file of planned strokes of a method; a log or a file of planned strokes is passed on unchanged.

    Raises:
        MethodError: the argument is neither a log nor planned strokes nor a method.
    """
    if not _is_method(argument):
        yield argument
        return
    from bench.errors import MethodError
    from bench.methods import compile_method, load_method
    from bench.runs import write_planned_strokes

    with TemporaryDirectory(prefix="mrbench-") as folder:
        planned = Path(folder) / "planned.npz"
        try:
            write_planned_strokes(planned, compile_method(load_method(argument)))
        except MethodError as error:
            raise MethodError(f"{argument} is not a log (.mcap), and as a method: {error}") from None
        yield str(planned)


def _is_method(argument: str) -> bool:
    """Return whether an argument names a method: a .json file, or a name that is neither a file nor a log."""
    path = Path(argument)
    if path.suffix in (".mcap", ".npz"):
        return False
    return path.suffix == ".json" or not path.is_file()
