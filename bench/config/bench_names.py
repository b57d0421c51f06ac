"""Names of the benches of a service, and the file in its data folder by which commands find them."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from bench.errors import ConfigError

DEFAULT_BENCH: Final = "bench"
"""Name of the only bench of a service that was started without names."""
BENCHES_FILE: Final = "benches.json"
"""File in a data folder: for each bench of its service the absolute path of bench.toml, or an address."""
_FIRST_EXECUTOR: Final = "agent"
"""Executor of the campaigns on `DEFAULT_BENCH`, as the catalogues of all versions call it."""
_NAME = re.compile(r"[a-z0-9_-]{1,40}")


def check_bench_name(name: str) -> str:
    """Return a name of a bench.

    Raises:
        ConfigError: it cannot be used.
    """
    if _NAME.fullmatch(name) is None:
        raise ConfigError(
            f"{name!r} cannot name a bench; use 1 to 40 small letters, digits, - and _, as in left=bench.toml"
        )
    if name == _FIRST_EXECUTOR:
        raise ConfigError(f"a bench cannot have the name {name}, which the catalogue uses; choose another")
    return name


def get_executor(bench: str) -> str:
    """Return the name that the catalogue gives to the executor of the campaigns on a bench."""
    return _FIRST_EXECUTOR if bench == DEFAULT_BENCH else bench


def get_bench_name(executor: str) -> str:
    """Return the name of the bench of an executor of campaigns."""
    return DEFAULT_BENCH if executor == _FIRST_EXECUTOR else executor


def is_executor(text: str) -> bool:
    """Return True for the executor of a bench, False for the scenario of a simulated plant."""
    return _NAME.fullmatch(text) is not None


def write_benches(data: Path, places: Mapping[str, str]) -> None:
    """Write the benches of a service into its data folder.

    Args:
        data: data folder.
        places: by name the absolute path of bench.toml, or the address of an agent.
    """
    (data / BENCHES_FILE).write_text(json.dumps(dict(places), indent=2) + "\n", "utf-8")


def find_bench(data: Path, config: Path) -> str:
    """Return the name of the bench with a ``bench.toml`` in the service of a data folder.

    Args:
        data: data folder.
        config: ``bench.toml``; if the service has one bench only, any file means that one.

    Raises:
        ConfigError: the service has several benches, and none has this file.
    """
    places = _read_benches(data)
    if len(places) == 1:
        return next(iter(places))
    found = next((name for name, place in places.items() if place == str(config.resolve())), None)
    if found is None:
        known = ", ".join(f"{name} ({place})" for name, place in places.items())
        raise ConfigError(f"no bench of the service has {config}; give the file of one of these: {known}")
    return found


def find_place(data: Path, name: str) -> str:
    """Return the ``bench.toml`` or the address of a bench of the service of a data folder; empty if not known."""
    return _read_benches(data).get(name, "")


def choose_bench(data: Path, name: str = "") -> str:
    """Return a bench of the service of a data folder.

    Args:
        data: data folder.
        name: name of the bench; empty for the only one.

    Raises:
        ConfigError: there are several benches and none is named, or there is none with this name.
    """
    places = _read_benches(data)
    if not name and len(places) == 1:
        return next(iter(places))
    if name in places:
        return name
    fault = f"there is no bench {name!r}" if name else "several benches"
    raise ConfigError(f"{fault}; the service of {data} has {', '.join(places)}: name one with --bench")


def _read_benches(data: Path) -> dict[str, str]:
    path = data / BENCHES_FILE
    try:
        places = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:  # before its first start, and of an older version, a service has one bench
        return {DEFAULT_BENCH: ""}
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: not readable ({error}); start the service again") from error
    return {str(name): str(place) for name, place in places.items()}
