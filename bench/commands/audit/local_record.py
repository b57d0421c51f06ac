"""Audit trail of commands that change a data folder."""

from collections.abc import Mapping
from pathlib import Path


def record(data: Path, action: str, target: str, old: Mapping[str, object], new: Mapping[str, object]) -> None:
    """Write a change by a command to the audit trail of the data folder, also beside a running service.

    Args:
        data: data folder.
        action: command.
        target: what was changed, such as the id of a campaign.
        old: former state.
        new: arguments; empty ones are left out.

    Raises:
        AuditError: the trail cannot be written; the change stays.
    """
    from bench.agent_protocol import get_sender
    from bench.audit import AUDIT_FILE, Act, AuditChain, redact

    values = redact({name: value for name, value in new.items() if value})
    act = Act(
        actor=get_sender().actor, action=action, target=target, old=dict(old) or None, new=values, outcome="ok"
    )
    AuditChain(data.resolve() / AUDIT_FILE).append(act)
