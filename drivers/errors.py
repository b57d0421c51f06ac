"""Errors of the drivers.

DriverError
├── NotConnected     used before `connect`, or the wire has gone
├── NoReply          the instrument was silent for longer than its deadline
├── BadReply         what came is no valid answer: frame, checksum, sequence, unexpected length
├── Refused          the instrument answered, and the answer is no: exception, abort, fault state
└── OutOfRange       a value outside the range of its channel; nothing was sent

Nothing of the libraries underneath escapes: their errors are translated here, with the cause kept. Each message
says which instrument, what was asked, what came or for how long nothing came, and what to do.
"""


class DriverError(Exception):
    """Base of everything that a driver raises on purpose."""

    exit_code = 1


class NotConnected(DriverError):  # noqa: N818 - reads as the sentence it makes
    """Used before `connect`, or the wire has gone."""


class NoReply(DriverError):  # noqa: N818
    """The instrument was silent for longer than its deadline."""


class BadReply(DriverError):  # noqa: N818
    """What came is no valid answer."""


class Refused(DriverError):  # noqa: N818
    """The instrument answered, and the answer is no."""


class OutOfRange(DriverError):  # noqa: N818
    """A value outside the range of its channel; nothing was sent."""
