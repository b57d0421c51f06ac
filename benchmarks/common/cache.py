"""What benchmarks share that take long: figures are made once and kept, and a later call goes on from them."""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any


def make_parser(description: str | None, kept: str) -> argparse.ArgumentParser:
    """The words ``--only`` and ``--keep`` that all of them take.

    Args:
        description: of the benchmark.
        kept: what is kept, in words.
    """
    made = argparse.ArgumentParser(description=description)
    made.add_argument("--only", default="", help="some of them, by comma")
    made.add_argument("--keep", type=Path, default=None, help=f"folder for {kept}")
    return made


def select_names(only: str, every: Sequence[str]) -> list[str]:
    """The names that were asked for; all of them if none."""
    wanted = [name for name in only.split(",") if name]
    return [name for name in every if not wanted or name in wanted]


@contextmanager
def open_folder(keep: Path | None) -> Iterator[Path]:
    """The folder to keep things in; one that is gone afterwards if none was named."""
    with TemporaryDirectory() as scratch:
        found = keep or Path(scratch)
        found.mkdir(parents=True, exist_ok=True)
        yield found


def load_figures(path: Path, make: Callable[[], Any]) -> Any:
    """The figures in a JSON file, made if it is not there yet."""
    if not path.exists():
        path.write_text(json.dumps(make()), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def read_rows(path: Path | None) -> list[dict[str, Any]]:
    """What was kept a line each; nothing where there is no file yet."""
    return [json.loads(text) for text in path.read_text().splitlines()] if path and path.exists() else []


def append_row(path: Path | None, row: dict[str, Any]) -> None:
    """Keep one more, where there is a file to keep it in."""
    if path:
        with path.open("a") as file:
            file.write(json.dumps(row) + "\n")


def run_mrbench(*words: object) -> None:
    """Type a command of the product."""
    subprocess.run([str(Path(sys.executable).with_name("mrbench")), *map(str, words)], check=True)
