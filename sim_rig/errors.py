"""Errors of the simulated rig.

SimRigError
├── ScenarioError   a scenario cannot be read, or contains something unknown or out of bounds
├── CommandsError   the commands to play are not a uniform record of displacement and drive
├── PlantError      the specimen of the scenario has no finite motion under these commands
├── WireError       a wire of the rig cannot be opened, or its address cannot be published
├── TruthError      a truth file cannot be written, or would replace another file
└── TrialError      a blind trial cannot continue: its seal is broken, or a recording failed

The command line prints an error with ``exit_code`` in one line, without a traceback.
"""


class SimRigError(Exception):
    """Base of every error that the simulated rig raises on purpose."""

    exit_code = 1


class ScenarioError(SimRigError):
    """A scenario cannot be read, or contains something unknown or out of bounds."""


class CommandsError(SimRigError):
    """The commands to play are not a uniform record of displacement and drive."""


class PlantError(SimRigError):
    """The specimen of the scenario has no finite motion under these commands."""


class WireError(SimRigError):
    """A wire of the rig cannot be opened, or its address cannot be published."""


class TruthError(SimRigError):
    """A truth file cannot be written, or would replace another file."""


class TrialError(SimRigError):
    """A blind trial cannot continue: its seal is broken, or a recording failed."""
