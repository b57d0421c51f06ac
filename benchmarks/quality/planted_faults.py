"""Test quality: share of faults planted in the code that make a test fail.

    python -m benchmarks.quality.planted_faults [--count 100] [--seed 1] [--jobs 2] [--out PAGE.md]

A fault changes one place of one file: an operator, a bound, a sign, a unit or a decision. Places are drawn by
seed over all packages. Each fault is planted in a copy of the committed sources. Then the tests run that execute
its line (``make coverage`` records them), those of the same package first. Compiled code is not recorded: there
all tests of the same package run. A fault that no test detects is a survivor and is listed.
"""

import argparse
import ast
import os
import random
import sqlite3
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import accumulate
from pathlib import Path
from queue import Queue
from typing import NamedTuple

from benchmarks.quality.branch_coverage import DATA, PACKAGES, ROOT

COPIES = ROOT / "build" / "faults"
TIMEOUT = 900.0
"""Time [s] after which the tests of one fault are stopped; a fault that hangs them is detected."""
MAX_TESTS = 400
"""Largest number of tests for one fault; a sample is drawn if more tests execute its line."""
_COMPARISONS = {
    ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "==", ast.In: "not in",
    ast.NotIn: "in", ast.Is: "is not", ast.IsNot: "is",
}  # fmt: skip
_ARITHMETIC = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "*", ast.Pow: "*"}
_UNITS = (1e3, 1e6, 1e9, 1e-3, 1e-6, 1e-9, 1000, 1_000_000, 1_000_000_000)
_FUNCTIONS = {"min": "max", "max": "min", "any": "all", "all": "any"}


class Fault(NamedTuple):
    """Change of one place in one file."""

    path: str
    line: int
    kind: str
    """operator, bound, sign, unit or decision."""
    before: str
    after: str
    start: int
    """First byte in the file."""
    stop: int
    """Position after the last byte."""

    def __str__(self) -> str:
        """Return place, kind and change on one line."""
        return f"{self.path}:{self.line}: {self.kind}: `{self.before}` -> `{self.after}`"


def main() -> int:
    """Plant the faults and print the table; return exit status 1 if less than 80 % are detected."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, help="also write the table to a page")
    options = parser.parse_args()
    faults = draw_faults(options.count, options.seed)
    copies: Queue[Path] = Queue()
    for number in range(options.jobs):
        copies.put(make_copy(number))
    results = []
    with ThreadPoolExecutor(options.jobs) as pool:
        for fault, detected in zip(faults, pool.map(lambda one: try_fault(one, copies), faults), strict=True):
            results.append((fault, detected))
            print("detected" if detected else "SURVIVED", fault, flush=True)
    page = format_page(results, options.seed)
    print(page)
    if options.out:
        options.out.write_text(page + "\n", encoding="utf-8")
    return int(sum(detected for _, detected in results) < 0.8 * len(results))


def draw_faults(count: int, seed: int) -> list[Fault]:
    """Draw faults: packages in proportion to their possible places, kinds with equal probability."""
    chance = random.Random(seed)
    listed = subprocess.run(["git", "ls-files", *PACKAGES], cwd=ROOT, capture_output=True, text=True, check=True)
    places = [
        fault
        for path in sorted(listed.stdout.split())
        if path.endswith(".py") and not path.endswith("__init__.py") and "migrations" not in path
        for fault in find_places(path, (ROOT / path).read_text("utf-8"))
    ]
    by_kind: dict[str, list[Fault]] = {}
    for fault in places:
        by_kind.setdefault(fault.kind, []).append(fault)
    drawn: list[Fault] = []
    while len(drawn) < count:
        fault = chance.choice(by_kind[chance.choice(sorted(by_kind))])
        if fault not in drawn:
            drawn.append(fault)
    return drawn


def find_places(path: str, source: str) -> Iterator[Fault]:
    """Find all faults that can be planted in one file."""
    text = SourceText(path, source)
    tree = ast.parse(source)
    for node in ast.walk(tree):
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
                yield from text.change_operator(left, right, _COMPARISONS[type(op)], "operator")
                yield from text.change_bounds([left, right])
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC and not _is_text(node):
                kind = "sign" if isinstance(op, ast.Add | ast.Sub) else "operator"
                yield from text.change_operator(left, right, _ARITHMETIC[type(op)], kind)
            case ast.BoolOp(op=op, values=[left, right]):
                yield from text.change_operator(
                    left, right, "or" if isinstance(op, ast.And) else "and", "decision"
                )
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                yield text.replace_node(node, "sign", text.get_text(operand))
            case ast.Call(func=ast.Name(id=name) as function, args=arguments) if name in _FUNCTIONS:
                yield text.replace_node(function, "decision", _FUNCTIONS[name])
                yield from text.change_bounds(arguments)
            case ast.Constant(value=float() | int() as value) if value in _UNITS:
                yield text.replace_node(node, "unit", "1.0")


class SourceText:
    """Bytes of one file, addressed by nodes of its syntax tree."""

    def __init__(self, path: str, source: str) -> None:
        self.path = path
        self.whole = source.encode()
        lengths = (len(line.encode()) for line in source.splitlines(keepends=True))
        self._starts = [0, *accumulate(lengths)]

    def find_span(self, node: ast.expr) -> tuple[int, int]:
        """Return the first byte of an expression and the position after its last byte."""
        last = node.end_lineno or node.lineno
        return (
            self._starts[node.lineno - 1] + node.col_offset,
            self._starts[last - 1] + (node.end_col_offset or 0),
        )

    def get_text(self, node: ast.expr) -> str:
        """Return the text of an expression."""
        start, stop = self.find_span(node)
        return self.whole[start:stop].decode()

    def replace_node(self, node: ast.expr, kind: str, after: str) -> Fault:
        """Return the fault that replaces a whole expression."""
        return Fault(self.path, node.lineno, kind, self.get_text(node), after, *self.find_span(node))

    def change_operator(self, left: ast.expr, right: ast.expr, after: str, kind: str) -> Iterator[Fault]:
        """Replace the operator between two expressions, if nothing else is between them."""
        start, stop = self.find_span(left)[1], self.find_span(right)[0]
        before = self.whole[start:stop].decode()
        if not set(before) & set("()#\n"):
            yield Fault(self.path, left.end_lineno or left.lineno, kind, before.strip(), f" {after} ", start, stop)

    def change_bounds(self, arguments: Sequence[ast.expr]) -> Iterator[Fault]:
        """Change numeric limits: an integer by one, any other number by a factor of ten."""
        for node in arguments:
            if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
                whole = isinstance(node.value, int)
                if not isinstance(node.value, bool):
                    yield self.replace_node(
                        node, "bound", repr(node.value + 1 if whole else (node.value or 0.1) * 10.0)
                    )


def _is_text(node: ast.BinOp) -> bool:
    sides = (node.left, node.right)
    return any(
        isinstance(side, ast.JoinedStr) or (isinstance(side, ast.Constant) and isinstance(side.value, str))
        for side in sides
    )


def make_copy(number: int) -> Path:
    """Copy the committed sources into a separate git work tree."""
    folder = COPIES / f"tree{number}"
    if folder.exists():
        subprocess.run(["git", "worktree", "remove", "--force", str(folder)], cwd=ROOT, check=True)
    subprocess.run(["git", "worktree", "add", "--detach", "-q", str(folder)], cwd=ROOT, check=True)
    return folder


def try_fault(fault: Fault, copies: "Queue[Path]") -> bool:
    """Plant one fault, run the tests that execute it, remove it; return whether a test failed."""
    folder = copies.get()
    path = folder / fault.path
    original = path.read_bytes()
    try:
        path.write_bytes(original[: fault.start] + fault.after.encode() + original[fault.stop :])
        return any(not run_tests(folder, some) for some in choose_tests(fault))
    finally:
        path.write_bytes(original)
        copies.put(folder)


def choose_tests(fault: Fault) -> list[list[str]]:
    """Choose at most ``MAX_TESTS`` tests that execute the line, those of the same package first."""
    mirrored = find_mirrored_folder(fault.path)
    executing = sorted(find_tests_of_line(fault.path, fault.line))
    near = [test for test in executing if test.startswith(mirrored)]
    far = [test for test in executing if not test.startswith(mirrored)]
    chance = random.Random(fault.start)
    far = sorted(chance.sample(far, min(len(far), MAX_TESTS)))
    groups = [near, far] if executing else [[mirrored]]
    return [group for group in groups if group]


def find_mirrored_folder(path: str) -> str:
    """Return the nearest folder of unit tests that mirrors a file."""
    folder = ROOT / "tests" / "unit" / Path(path).parent
    while not folder.is_dir():
        folder = folder.parent
    return folder.relative_to(ROOT).as_posix()


def find_tests_of_line(path: str, line: int) -> set[str]:
    """Return the tests that executed a line, from the data of ``make coverage``."""
    with sqlite3.connect(f"file:{DATA}?mode=ro", uri=True) as data:
        rows = data.execute(
            "SELECT DISTINCT context.context FROM arc JOIN file ON file.id = arc.file_id "
            "JOIN context ON context.id = arc.context_id WHERE file.path = ? AND (arc.fromno = ? OR arc.tono = ?)",
            (path, line, line),
        )
        contexts = {str(row[0]) for row in rows}
    return {context.partition("|")[0] for context in contexts if "::" in context}


def run_tests(folder: Path, tests: list[str]) -> bool:
    """Run tests in a copy of the sources; return whether they pass. A time-out is a failure."""
    listing = folder / "selected_tests.txt"
    listing.write_text("\n".join(tests), encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:cacheprovider",
        "-m",
        "not slow",
        f"@{listing}",
    ]
    environment = os.environ | {"PYTHONPATH": str(folder)}
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, timeout=TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def format_page(results: list[tuple[Fault, bool]], seed: int) -> str:
    """Return counts by package and by kind, and the survivors, as a Markdown page."""
    lines = [
        f"{sum(detected for _, detected in results)} of {len(results)} planted faults made a test fail "
        f"(seed {seed}; `python -m benchmarks.quality.planted_faults --count {len(results)} --seed {seed}`).",
        "",
        "| drawn over | faults | detected |",
        "| --- | --- | --- |",
    ]
    keys: tuple[tuple[str, Callable[[Fault], str]], ...] = (
        ("package", lambda f: f.path.partition("/")[0]),
        ("kind", lambda f: f.kind),
    )
    for name, key in keys:
        total = Counter(key(fault) for fault, _ in results)
        found = Counter(key(fault) for fault, detected in results if detected)
        lines += [f"| {name} {each} | {total[each]} | {found[each]} |" for each in sorted(total)]
    survivors = [f"- {fault}" for fault, detected in results if not detected]
    return "\n".join([*lines, "", "Survivors:", "", *(survivors or ["- none"])])


if __name__ == "__main__":
    sys.exit(main())
