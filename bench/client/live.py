"""Live samples of a bench, as arrays with units."""

import math
import time
from collections.abc import Iterator

import numpy as np
import orjson
from websockets.sync.client import ClientConnection

from bench.client.arrays import Arrays
from bench.client.errors import ClientError
from bench.client.session import Session
from bench.errors import LiveDataError
from bench.live import Channel, LiveBatch, decode_batch, parse_channels

_SILENCE_LIMIT = 6.0
"""Time [s] without any message after which the service counts as lost; it sends its clock twice a second."""


class LiveSamples(Arrays):
    """Consecutive samples by channel; ``time`` is the time since the first of them.

    Args:
        batch: batch of the service.
    """

    def __init__(self, batch: LiveBatch) -> None:
        values = {"time": np.arange(batch.count) * batch.period_s}
        columns = zip(batch.channels, batch.values.astype(np.float64), strict=True)
        super().__init__(
            values | {channel.name: column for channel, column in columns}, {"time": "s", **dict(batch.channels)}
        )
        self.utc_s = batch.utc_s
        """UTC of the first sample [s since 1970]."""
        self.sequence = batch.sequence
        """Number of the batch; a gap means lost batches."""
        self._end_utc_s = batch.end_utc_s

    @property
    def age_s(self) -> float:
        """Time since the newest sample was taken [s], by the clock of this machine."""
        return time.time() - self._end_utc_s


def iterate_live(session: Session, rate_hz: float = math.inf, bench: str | None = None) -> Iterator[LiveSamples]:
    """Yield live samples until the caller stops.

    Args:
        session: session with the service.
        rate_hz: largest rate of the samples [Hz]; a faster bench is decimated, which keeps every extreme.
        bench: name of the bench; needed if the service has several.

    Raises:
        ClientError: the service refuses, cannot be reached or falls silent.
    """
    channels: tuple[Channel, ...] = ()
    wishes: dict[str, object] = {} if math.isinf(rate_hz) else {"rate_hz": rate_hz}
    if bench is not None:  # a service of an older version has one bench
        wishes["bench"] = bench
    with session.connect("/live", {"acknowledge": True, **wishes}) as socket:
        while True:
            message = socket.recv(_SILENCE_LIMIT)
            if isinstance(message, bytes):
                batch = _decode(message, channels)
                yield LiveSamples(batch)
                _acknowledge(socket, batch)
            else:
                channels = _read_channels(message, channels)


def _decode(data: bytes, channels: tuple[Channel, ...]) -> LiveBatch:
    try:
        return decode_batch(data, channels)
    except LiveDataError as error:
        raise ClientError(str(error)) from error


def _acknowledge(socket: ClientConnection, batch: LiveBatch) -> None:
    """Tell the service that a batch is handled, so that a slow script gets new samples instead of old ones."""
    socket.send(orjson.dumps({"received": batch.sequence}).decode())


def _read_channels(message: str, channels: tuple[Channel, ...]) -> tuple[Channel, ...]:
    """Return the channels that a message lists; those known before if it is about something else."""
    try:
        content = orjson.loads(message)
        return parse_channels(content["data"]["channels"]) if content["topic"] == "channels" else channels
    except (ValueError, LookupError, TypeError, LiveDataError) as error:
        raise ClientError(f"the service sends no live data ({error!r}); use a client of its version") from error
