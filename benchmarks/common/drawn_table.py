"""Command line and table of a benchmark that draws its cases at random."""

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

Outcome = TypeVar("Outcome")


def make_parser(description: str | None, count: str, default: int) -> argparse.ArgumentParser:
    """Return the parser of a benchmark's options.

    Args:
        description: docstring of its module.
        count: what is drawn, such as ``recordings``; the option states how many.
        default: how many by default.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(f"--{count}", dest="count", type=int, default=default, help=f"{count} of each row")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--cases", default="", help="only rows whose name contains this")
    parser.add_argument("--out", type=Path)
    return parser


def list_seeds(options: argparse.Namespace) -> range:
    """Return the seeds of the cases; those of different ``--seed`` do not overlap."""
    return range(1000 * options.seed, 1000 * options.seed + options.count)


def print_table(columns: Sequence[str], rows: Iterable[str], page: Path | None) -> None:
    """Print a Markdown table row by row as its rows are ready; also write it to a page."""
    lines = []
    for line in _make_lines(columns, rows):
        print(line, flush=True)
        lines.append(line)
    if page:
        page.write_text("\n".join(lines) + "\n", "utf-8")


def run_trial(
    columns: Sequence[str],
    outcomes: Iterable[Outcome],
    format_row: Callable[[Outcome], str],
    format_summary: Callable[[Sequence[Outcome]], list[str]],
    page: Path | None,
) -> None:
    """Print a table row by row as the outcomes are ready, then their summary; also write both to a page."""
    known: list[Outcome] = []

    def format_rows() -> Iterator[str]:
        for outcome in outcomes:
            known.append(outcome)
            yield format_row(outcome)

    lines = []
    for line in _make_lines(columns, format_rows()):
        print(line, flush=True)
        lines.append(line)
    summary = format_summary(known)
    print("\n".join(summary))
    if page:
        page.write_text("\n".join([*summary, "", *lines]) + "\n", "utf-8")


def _make_lines(columns: Sequence[str], rows: Iterable[str]) -> Iterable[str]:
    yield f"| {' | '.join(columns)} |"
    yield f"| {' | '.join('---' for _ in columns)} |"
    yield from rows
