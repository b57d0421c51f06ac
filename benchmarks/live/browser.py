"""Chromium and Node, which operate the page for the benchmarks, by scripts of this folder and of the tests."""

import shutil
import subprocess
from pathlib import Path

from bench.errors import RunError

WATCH_STATE = Path(__file__).parents[2] / "tests" / "system" / "javascript" / "watch_state.mjs"
"""Script of the tests that prints the states which the page shows."""
MEASURE_PAGE = Path(__file__).with_name("measure_page.mjs")


def start_script(script: Path, address: str, *arguments: str) -> "subprocess.Popen[str]":
    """Start a script on the page of a service.

    Args:
        script: file of the script; it receives the address, the browser and the arguments.
        address: address of the page, with the token.

    Raises:
        RunError: Node or Chromium is not installed.
    """
    programs = {program: shutil.which(program) for program in ("node", "chromium")}
    missing = [program for program, path in programs.items() if path is None]
    if missing:
        raise RunError(f"{' and '.join(missing)} not found; install with `apt-get install nodejs chromium`")
    command = [str(programs["node"]), str(script), address, str(programs["chromium"]), *arguments]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
