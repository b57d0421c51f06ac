"""The fenced blocks of a page that can be run, and what a reader is told to expect of them."""

import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/tutorial/*.md")), *sorted(ROOT.glob("docs/how-to/*.md"))]

_BLOCK = re.compile(r"(?:<!-- (not run|file): (.+?) -->\n)?```(\w+)\n(.*?)```", re.DOTALL)
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_CLOSE = 0.05
"""[1] relative difference at which a number shown still counts as the one printed."""


class Block(NamedTuple):
    language: str
    text: str
    mark: str
    """``not run``, ``file`` or nothing."""
    said: str
    """Why it is not run, or the file's name."""


def blocks(page: Path) -> list[Block]:
    found = _BLOCK.finditer(page.read_text(encoding="utf-8"))
    return [Block(match[3], match[4], match[1] or "", match[2] or "") for match in found]


def carry_out(block: Block, folder: Path, environment: dict[str, str]) -> None:
    """Do what a reader would do with a block; fails where a command fails or says something else."""
    if block.mark == "file":
        (folder / block.said).write_text(block.text, encoding="utf-8")
    elif block.mark == "not run":
        return
    elif block.language == "sh":
        run(block.text, folder, environment)
    elif block.language == "console":
        for command in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
            words, _, expected = command.partition("\n")
            said = run(words, folder, environment)
            assert as_shown(said, expected), f"$ {words}\nsays\n{said}\nand not\n{expected}"


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


def as_shown(said: str, expected: str) -> bool:
    """Whether an output is the one shown: ``...`` stands for anything, numbers may differ by five per cent."""
    pattern = "".join(
        ".*?" if part == "..." else f"({_NUMBER.pattern})" if _NUMBER.fullmatch(part) else re.escape(part)
        for part in re.split(rf"(\.\.\.|{_NUMBER.pattern})", expected.strip())
    )
    found = re.fullmatch(pattern, said.strip(), re.DOTALL)
    shown = [float(number) for number in _NUMBER.findall(expected)]
    return found is not None and [float(n) for n in found.groups()] == pytest.approx(shown, rel=_CLOSE)
