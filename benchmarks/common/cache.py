"""Cache for long benchmarks: results are computed once and stored, and a later call continues from them."""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any


def make_parser(description: str | None, contents: str) -> argparse.ArgumentParser:
    """Create a parser with the common options ``--only`` and ``--keep``.

    Args:
        description: description of the benchmark.
        contents: description of what the folder of ``--keep`` contains.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--only", default="", help="names to run, separated by commas")
    parser.add_argument("--keep", type=Path, default=None, help=f"folder for {contents}")
    return parser


def select_names(only: str, names: Sequence[str]) -> list[str]:
    """Return the requested names in their order; all names if none is requested."""
    requested = [name for name in only.split(",") if name]
    return [name for name in names if not requested or name in requested]


@contextmanager
def open_folder(keep: Path | None) -> Iterator[Path]:
    """Yield the given folder, or a temporary one that is removed afterwards."""
    with TemporaryDirectory() as temporary:
        folder = keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        yield folder


def load_results(path: Path, compute: Callable[[], Any]) -> Any:
    """Return the results in a JSON file; compute and write them if it does not exist."""
    if not path.exists():
        path.write_text(json.dumps(compute()), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def read_rows(path: Path | None) -> list[dict[str, Any]]:
    """Return the rows of a JSON lines file; empty without a file."""
    return [json.loads(text) for text in path.read_text().splitlines()] if path and path.exists() else []


def append_row(path: Path | None, row: dict[str, Any]) -> None:
    """Append one row to a JSON lines file, if one is given."""
    if path:
        with path.open("a") as file:
            file.write(json.dumps(row) + "\n")


def run_mrbench(*words: object) -> None:
    """Run a command of the product."""
    subprocess.run([str(Path(sys.executable).with_name("mrbench")), *map(str, words)], check=True)
