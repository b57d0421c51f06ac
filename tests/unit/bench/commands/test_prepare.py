"""Arguments of ``mrbench prepare``."""

import pytest
import typer

from bench import agent_protocol
from bench.commands.prepare import prepare


def test_a_move_without_a_target_is_misuse_and_not_a_move_to_zero(monkeypatch):
    requests = []
    monkeypatch.setattr(agent_protocol, "request_setup_step", lambda *given: requests.append(given) or "done")
    with pytest.raises(typer.BadParameter, match="--to METRES"):
        prepare("move")
    assert requests == []
    prepare("move", 0.0)
    prepare("tare")
    with pytest.raises(typer.BadParameter, match="unknown step lubricate; the steps are home, move, mount"):
        prepare("lubricate")
    with pytest.raises(typer.BadParameter, match="--to is the target of move; home takes no position"):
        prepare("home", 0.01)
    assert [(step, target) for _, step, target in requests] == [("move", 0.0), ("tare", None)]
