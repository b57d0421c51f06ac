"""Chromium and Node, which operate the page for the benchmarks."""

import shutil
import subprocess
from pathlib import Path

from bench.errors import RunError


def start_script(name: str, address: str, *arguments: str) -> "subprocess.Popen[str]":
    """Start a script of this folder on the page of a service.

    Args:
        name: file name of the script; it receives the address, the browser and the arguments.
        address: address of the page, with the token.

    Raises:
        RunError: Node or Chromium is not installed.
    """
    programs = {program: shutil.which(program) for program in ("node", "chromium")}
    missing = [program for program, path in programs.items() if path is None]
    if missing:
        raise RunError(f"{' and '.join(missing)} not found; install with `apt-get install nodejs chromium`")
    command = [
        str(programs["node"]),
        str(Path(__file__).with_name(name)),
        address,
        str(programs["chromium"]),
        *arguments,
    ]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
