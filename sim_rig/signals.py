"""What the instruments see of the rig, and all that they see of it: reported samples and two commands."""

from typing import Protocol

import numpy as np
import numpy.typing as npt


class Signals(Protocol):
    """The rig as its instruments see it; may be used from any thread."""

    def now_ns(self) -> int:
        """The rig's clock [ns]."""

    def latest(
        self, channel: str, count: int, before_ns: int
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """The newest samples of a channel, as its sensor reports them, at its own rate.

        Args:
            channel: one of ``sim_rig.sensors.CHANNELS``.
            count: how many at most.
            before_ns: [ns] on the rig's clock; later samples are left out.

        Returns:
            (K,) instants on the rig's clock [ns], increasing, and (K,) values in the channel's unit, NaN where the
            sensor has none; K is less than ``count`` where so many are not there or no longer kept.
        """

    def lead(self, position: float, at_ns: int, since_ns: int) -> None:
        """Command where the actuator is to be at an instant to come; a command for an earlier one replaces it.

        Args:
            position: [m]
            at_ns: [ns] on the rig's clock.
            since_ns: from when on [ns] it goes straight there.
        """

    def command(self, channel: str, value: float, at_ns: int | None = None) -> None:
        """Command ``displacement`` [m] of the actuator or ``drive`` [V or A] of the amplifier.

        Args:
            channel: which of the two.
            value: in its unit.
            at_ns: [ns] on the rig's clock, from which it holds; not before that of the last one; now if none.
        """
