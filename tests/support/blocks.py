"""Fenced blocks of a documentation page that can be run, with their expected output."""

import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/tutorial/*.md")), *sorted(ROOT.glob("docs/how-to/*.md"))]

_BLOCK = re.compile(r"(?:<!-- (not run|file): (.+?) -->\n)?```(\w+)\n(.*?)```", re.DOTALL)
_RECORDING = re.compile(r"^mrbench run quick --scenario default --out (\S+)$", re.MULTILINE)
"""Command by which ten blocks begin."""
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_TOLERANCE = 0.05
"""Largest relative difference [1] between a number in the page and the printed number."""


class Block(NamedTuple):
    language: str
    text: str
    mark: str
    """``not run``, ``file`` or empty."""
    argument: str
    """Reason why the block is not run, or name of the file."""


def blocks(page: Path) -> list[Block]:
    found = _BLOCK.finditer(page.read_text(encoding="utf-8"))
    return [Block(match[3], match[4], match[1] or "", match[2] or "") for match in found]


def carry_out(block: Block, folder: Path, environment: dict[str, str], log: Path) -> None:
    """Execute a block as a reader would; fail if a command fails or prints another output.

    A block without output gets a copy of the log that `_RECORDING` has made before.
    """
    if block.mark == "file":
        (folder / block.argument).write_text(block.text, encoding="utf-8")
    elif block.mark == "not run":
        return
    elif block.language == "sh":
        run(_RECORDING.sub(rf"cp '{log}' \1", block.text), folder, environment)
    elif block.language == "console":
        for command in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
            words, _, expected = command.partition("\n")
            output = run(words, folder, environment)
            assert is_expected(output, expected), f"$ {words}\nprints\n{output}\ninstead of\n{expected}"


def run(script: str, folder: Path, environment: dict[str, str]) -> str:
    words = ["bash", "-euo", "pipefail", "-c", script]
    done = subprocess.run(
        words,
        cwd=folder,
        env=environment,
        text=True,
        timeout=280,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, f"{script}\nends with {done.returncode}:\n{done.stdout}"
    return done.stdout


def is_expected(output: str, expected: str) -> bool:
    """Return whether an output is the expected one; ``...`` matches any text, numbers may differ by 5 %."""
    pattern = "".join(
        ".*?" if part == "..." else f"({_NUMBER.pattern})" if _NUMBER.fullmatch(part) else re.escape(part)
        for part in re.split(rf"(\.\.\.|{_NUMBER.pattern})", expected.strip())
    )
    found = re.fullmatch(pattern, output.strip(), re.DOTALL)
    shown = [float(number) for number in _NUMBER.findall(expected)]
    return found is not None and [float(n) for n in found.groups()] == pytest.approx(shown, rel=_TOLERANCE)
