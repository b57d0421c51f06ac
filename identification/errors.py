"""Errors of the identification.

IdentificationError
├── LogUnreadable       a log is no log of ours, is truncated, or lacks a channel
└── NothingToFit        the stretches left for a fit hold too little

A fit that does not converge is no error: it is a result and says so. ``exit_code`` tells the command line
that the message is for a person and needs no traceback.
"""


class IdentificationError(Exception):
    """Base of everything that the identification raises on purpose."""

    exit_code = 1


class LogUnreadable(IdentificationError):  # noqa: N818 - reads as the sentence it makes
    """A log is no log of ours, is truncated, or lacks a channel."""


class NothingToFit(IdentificationError):  # noqa: N818 - reads as the sentence it makes
    """The stretches left for a fit hold too little."""
