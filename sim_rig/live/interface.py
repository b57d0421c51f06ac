"""Interface of the rig to its simulated instruments: reported samples, and commands from them."""

from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from sim_rig.plant import Array

TimeArray: TypeAlias = npt.NDArray[np.int64]
"""Instants on the rig's clock [ns]."""


class RigInterface(Protocol):
    """The rig as its instruments use it; may be used from any thread."""

    def now_ns(self) -> int:
        """Return the rig's clock [ns]."""

    def read_latest(self, channel: str, count: int, before_ns: int) -> tuple[TimeArray, Array]:
        """Return the newest samples of a channel, as its sensor reports them, at its own rate.

        Args:
            channel: one of ``sim_rig.sensors.channels.CHANNELS``.
            count: largest number of samples.
            before_ns: [ns] on the rig's clock; later samples are left out.

        Returns:
            (K,) instants on the rig's clock [ns], increasing, and (K,) values in the channel's unit, NaN where the
            sensor has no value. K is less than ``count`` if fewer samples exist or are still kept.
        """

    def schedule_position(self, position: float, at_ns: int, since_ns: int) -> None:
        """Command the actuator's position at a future instant; a command for an earlier one replaces it.

        Args:
            position: [m]
            at_ns: [ns] on the rig's clock.
            since_ns: [ns] start of the straight line to that position.
        """

    def command(self, channel: str, value: float, at_ns: int | None = None) -> None:
        """Command ``displacement`` [m] of the actuator, ``drive`` [V or A] or ``shunt`` [N] of the load cell.

        Args:
            channel: ``displacement``, ``drive``, or ``shunt``: force that the load cell reads in addition.
            value: in its unit.
            at_ns: [ns] on the rig's clock, from which it holds, not before the last command; None for now.
        """
