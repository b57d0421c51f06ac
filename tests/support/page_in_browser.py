"""Scripts that operate the web page in a real browser, on the fake service of the tests."""

import json
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.support.fake_page_service import STATIC, TOKEN, FakeBench, served

FOLDER = Path(__file__).parents[1] / "system" / "javascript"
NODE = shutil.which("node")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
node_test = pytest.mark.skipif(NODE is None, reason="Node is not installed; it runs the modules of the page")
"""Mark of a test that needs Node alone."""
_NEEDED = [
    node_test,
    pytest.mark.skipif(
        CHROMIUM is None, reason="chromium is not installed; `apt-get install chromium` installs it"
    ),
    pytest.mark.skipif(
        not (FOLDER / "node_modules" / "axe-core").is_dir(),
        reason="a package is not installed; run `npm ci --prefix tests/system/javascript`",
    ),
]


def browser_test(function: Callable[..., None]) -> Callable[..., None]:
    """Mark a test that needs Node, chromium and the packages of the scripts."""
    for mark in _NEEDED:
        function = mark(function)
    return function


def operate_page(bench: FakeBench, script: str) -> dict[str, Any]:
    """Run a script of `tests/system/javascript` on the page of a fake bench; return what it has seen."""
    with served(bench) as address:
        command = [str(NODE), str(FOLDER / script), address, TOKEN, str(CHROMIUM)]
        # Less than the time limit of a test, so that what the browser has printed is still shown.
        result = subprocess.run(command, capture_output=True, text=True, timeout=280, check=False)
    assert result.returncode == 0, result.stderr
    seen: dict[str, Any] = json.loads(result.stdout)
    return seen


def run_module(script: str, module: str, questions: Sequence[Any] = ()) -> Any:
    """Run a script of `tests/system/javascript` on a module of the page, without a browser; return its answers."""
    command = [str(NODE), str(FOLDER / script), str(STATIC / module)]
    asked = json.dumps(questions)
    result = subprocess.run(command, input=asked, capture_output=True, text=True, timeout=180, check=False)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)
