"""Errors of the identification.

IdentificationError
├── EffectFileError       not an effect file, or not a valid one
├── UnreadableLogError    not an mrbench log, or truncated, or without a channel
└── UnusableDataError     too few or unsuitable samples for a fit

A fit that does not converge is a result and not an error. The command line prints an error with ``exit_code`` in
one line, without a traceback.
"""


class IdentificationError(Exception):
    """Base class of all expected errors of the identification."""

    exit_code = 1


class EffectFileError(IdentificationError, ValueError):
    """An effect file is not valid, or cannot be read or written."""


class UnreadableLogError(IdentificationError):
    """The file is not an mrbench log, is truncated, or lacks a channel."""


class UnusableDataError(IdentificationError):
    """The recordings contain too few or unsuitable samples for a fit."""
