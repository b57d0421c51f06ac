"""File of the audit trail of a rig agent: in its folder of logs, named by its ``bench.toml``."""

from pathlib import Path

from bench.config import BenchConfig, load_config


def find_agent_trail(source: Path) -> Path:
    """Return the file of the audit trail of the agent of a ``bench.toml``.

    Raises:
        ConfigError: the configuration is not valid.
    """
    return make_agent_trail(load_config(source), source)


def make_agent_trail(config: BenchConfig, source: Path) -> Path:
    """Return the file of the audit trail of an agent.

    Args:
        config: configuration of the bench.
        source: its file.
    """
    return source.absolute().parent / config.rig.folder / f"{source.stem}.audit.jsonl"
