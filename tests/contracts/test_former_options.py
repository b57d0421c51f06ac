"""Former names of options are accepted and not shown."""

import pytest
from typer.testing import CliRunner

from bench.cli import _make_application, entry_points
from identification.errors import IdentificationError


def invoke(command, *arguments):
    application = _make_application(entry_points(group="mrbench.commands").select(name=command))
    return CliRunner().invoke(application, [command, *arguments])


@pytest.mark.parametrize(
    ("command", "option", "former"),
    [("diagnose", ("--cross-check",), ("--witness",)), ("tune", ("--time-weight", "0.1"), ("--price", "0.1"))],
)
def test_a_former_option_is_accepted_and_only_the_present_one_is_shown(command, option, former, tmp_path):
    for given in (option, former):
        result = invoke(command, str(tmp_path / "no.mcap"), *given, "--out", str(tmp_path / "out.json"))
        assert isinstance(result.exception, IdentificationError), result.output
    shown = invoke(command, "--help").output
    assert option[0] in shown
    assert former[0] not in shown
