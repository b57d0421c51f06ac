"""Commands that the demonstration runs."""

import pytest

from bench.demo.demo import _run_mrbench
from bench.errors import RunError


def test_a_failed_command_ends_the_demonstration_and_a_successful_one_does_not():
    _run_mrbench("--help")
    with pytest.raises(RunError, match="mrbench no_such_command failed"):
        _run_mrbench("no_such_command")
