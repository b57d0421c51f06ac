"""What the agent says of one instrument and its wire."""

from collections.abc import Callable

from bench.agent.messages import InstrumentStatus
from bench.rig.acquisition import Acquisition
from bench.rig.instruments import Named


def instrument_status(one: Named, acquisition: Acquisition, clock: Callable[[], int]) -> InstrumentStatus:
    """Its health, and how well its clock is known.

    Args:
        one: the instrument.
        acquisition: that reads it.
        clock: of the bench [ns].
    """
    health, map_ = one.instrument.health(), acquisition.maps[one.name]
    down = one.name in acquisition.down
    return InstrumentStatus(
        name=one.name,
        driver=one.driver,
        address=one.address,
        connected=health.connected and not down,
        received=health.received,
        lost=health.lost,
        corrupted=health.corrupted,
        resynchronised=health.resynchronised,
        age_s=None if health.last_ns is None else (clock() - health.last_ns) * 1e-9,
        skew_s=map_.skew() if map_.known else None,
        words=health.words or ("does not answer" if down else ""),
    )
