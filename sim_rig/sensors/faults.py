"""Faults of channels: readings that repeat or are missing for a while."""

from collections.abc import Sequence

import numpy as np

from sim_rig.plant import Array
from sim_rig.scenario import ChannelFault, Scenario


def apply_faults(scenario: Scenario, time: Array, values: dict[str, Array]) -> dict[str, Array]:
    """Apply the scenario's faults to the channels of a whole run."""
    return {
        name: apply_channel_faults(select_faults(scenario, name), time, channel, float(channel[0]))
        for name, channel in values.items()
    }


def select_faults(scenario: Scenario, channel: str) -> list[ChannelFault]:
    """Return the faults of one channel."""
    return [fault for fault in scenario.faults if fault.channel == channel]


def apply_channel_faults(faults: Sequence[ChannelFault], time: Array, values: Array, previous: float) -> Array:
    """Apply faults to the readings of a channel: stuck, it repeats its last reading; missing, it reads NaN.

    Args:
        faults: of this channel.
        time: (N,) since the start of the run [s].
        values: (N,) in the channel's unit.
        previous: reading before the first of them.
    """
    for fault in faults:
        failed = (time >= fault.start) & (time < fault.start + fault.duration)
        if failed.any():
            first = int(np.argmax(failed))
            last = values[first - 1] if first else previous
            values = np.where(failed, last if fault.kind == "stuck" else np.nan, values)
    return values
