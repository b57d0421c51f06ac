"""Decoder snapshot: state of an instrument's decoder in a log, from which its frames can be decoded again."""

from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class ReplayableInstrument(Protocol):
    """An instrument whose frames can be replayed."""

    def snapshot_decoder(self) -> dict[str, Any]:
        """Return the state from which its decoder decodes the frames to come; JSON."""


def snapshot_decoder(instrument: object) -> dict[str, Any] | None:
    """Return the state of an instrument's decoder; None if its frames cannot be replayed."""
    return instrument.snapshot_decoder() if isinstance(instrument, ReplayableInstrument) else None
