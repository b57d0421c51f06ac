"""Conditions of the pages: the command on the path, and a folder with recordings made elsewhere."""

import os
import sys
from pathlib import Path

import pytest

from tests.support import blocks

STROKES = {"10mm_1Hz.csv": (0, 7500), "5mm_2.5Hz.csv": (7500, 15704)}
"""First and last sample of `quick` in each file."""


@pytest.fixture(scope="session")
def environment():
    cache = os.environ.get("MRBENCH_CACHE")
    more = {"MRBENCH_CACHE": str(Path(cache).resolve())} if cache else {}
    return os.environ | more | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


@pytest.fixture(scope="session")
def log(tmp_path_factory, environment):
    """Record the log that most pages begin with."""
    folder = tmp_path_factory.mktemp("recorded")
    blocks.run("mrbench run quick --scenario default --out quick.mcap", folder, environment)
    return folder / "quick.mcap"


@pytest.fixture(scope="session")
def recordings(log, environment):
    """Make files of two strokes, and one of the first stroke with the headers of a vendor."""
    blocks.run(f"mrbench export {log.name} --format csv --out quick.csv", log.parent, environment)
    header, *rows = log.with_name("quick.csv").read_text().splitlines()
    kept = [header.split(",").index(name) for name in ("time_s", "displacement_m", "force_n", "voltage_v")]

    def lines(start, stop):
        return [",".join(row.split(",")[place] for place in kept) for row in rows[start:stop]]

    files = {
        f"recordings/{name}": ["time_s,displacement_m,force_n,voltage_v", *lines(*span)]
        for name, span in STROKES.items()
    }
    return files | {"vendor.csv": ["Time,LVDT,Load,Command", *lines(*STROKES["10mm_1Hz.csv"])]}


@pytest.fixture
def folder(tmp_path, recordings):
    """Return the working folder of a reader."""
    (tmp_path / "recordings").mkdir()
    for name, lines in recordings.items():
        (tmp_path / name).write_text("\n".join(lines) + "\n")
    return tmp_path
