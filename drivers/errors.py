"""Errors of the drivers.

DriverError
├── NotConnectedError    used before `connect`, or the wire is gone
├── NoReplyError         no reply within the deadline
├── InvalidReplyError    wrong frame, checksum, sequence or length
├── RefusedError         exception, abort or fault state in the reply
└── OutOfRangeError      value outside the range of its channel; nothing was sent

Errors of the libraries are translated into these and chained as their cause. Each message names the instrument,
the request, the reply or the time waited for it, and what to do.
"""


class DriverError(Exception):
    """Base class of all errors that drivers raise."""

    exit_code = 1


class NotConnectedError(DriverError):
    """The driver was used before `connect`, or the wire is gone."""


class NoReplyError(DriverError):
    """The instrument did not reply within the deadline."""


class InvalidReplyError(DriverError):
    """The received bytes are not a valid reply."""


class RefusedError(DriverError):
    """The instrument replied with an exception, an abort or a fault state."""


class OutOfRangeError(DriverError):
    """The value is outside the range of its channel; nothing was sent."""
