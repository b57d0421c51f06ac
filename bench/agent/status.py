"""Parts of the agent's status: instruments with their wires, warnings; description of the bench."""

from collections.abc import Iterable

from bench.agent_protocol import BenchChannel, BenchDescription, BenchLimit, InstrumentStatus, LimitStatus
from bench.config import BenchConfig
from bench.recorder import make_channel_infos
from bench.rig import Acquisition, RegisteredInstrument, Rig
from bench.safety import LimitMatrix
from drivers import Clock
from drivers.actuator import Actuator

_LIMIT_UNITS = {
    "force": "N",
    "displacement": "m",
    "actuator_velocity": "m/s",
    "following_error": "m",
    "coil_current": "A",
    "coil_voltage": "V",
    "temperature": "degC",
    "force_age": "s",
    "setpoint_lateness": "s",
}


def make_instrument_statuses(
    instruments: Iterable[RegisteredInstrument], acquisition: Acquisition, clock: Clock
) -> tuple[InstrumentStatus, ...]:
    """Describe the health of instruments and the accuracy of their clock maps.

    Args:
        instruments: the instruments.
        acquisition: reads the instruments.
        clock: bench clock [ns].
    """
    return tuple(_make_status(one, acquisition, clock) for one in instruments)


def _make_status(registered: RegisteredInstrument, acquisition: Acquisition, clock: Clock) -> InstrumentStatus:
    health, clock_map = registered.instrument.get_health(), acquisition.maps[registered.name]
    has_failed = registered.name in acquisition.failed_instruments
    return InstrumentStatus(
        name=registered.name,
        driver=registered.driver,
        address=registered.address,
        connected=health.connected and not has_failed,
        received=health.received,
        lost=health.lost,
        corrupted=health.corrupted,
        resynchronised=health.resynchronised,
        age_s=None if health.last_ns is None else (clock() - health.last_ns) * 1e-9,
        clock_error_bound_s=clock_map.compute_error_bound() if clock_map.is_known else None,
        message=health.message or ("does not reply" if has_failed else ""),
    )


def make_limit_statuses(limits: LimitMatrix) -> tuple[LimitStatus, ...]:
    """Describe limits in force."""
    return tuple(
        LimitStatus(quantity=quantity, action=action.name.lower(), value=value)
        for quantity, thresholds in limits.items()
        for action, value in thresholds.items()
    )


def collect_warnings(
    acquisition: Acquisition, priority_warning: str, setpoint_timeout: float, space_warning: str
) -> tuple[str, ...]:
    """Return the warnings of the agent and of the threads that read the instruments.

    Args:
        acquisition: reads the instruments.
        priority_warning: warning that real-time priority is not permitted; empty if it is.
        setpoint_timeout: time without a setpoint after which the drive stops by itself [s].
        space_warning: warning that the disk of the logs is nearly full; empty if it is not.
    """
    # Every thread reports the same missing priority, so it is listed once, with its consequence.
    warnings = [warning for warning in acquisition.warnings if warning != priority_warning]
    if priority_warning:
        warnings.append(
            f"{priority_warning}; the drive stops by itself {setpoint_timeout:g} s after the last setpoint"
        )
    return tuple([*warnings, space_warning] if space_warning else warnings)


def find_travel(actuator: Actuator) -> tuple[float, float] | None:
    """Return the positions of both end stops [m]; None while the rod's position is not known."""
    if actuator.reference_state.value in ("unreferenced", "reference_lost"):
        return None
    position = next(one for one in actuator.channels if one.name == "actuator_position")
    return position.low, position.high


def describe_bench(config: BenchConfig, rig: Rig) -> BenchDescription:
    """Describe limits and channels of a bench."""
    infos = make_channel_infos(config, rig)
    return BenchDescription(
        name=config.rig.name,
        specimen=config.rig.specimen,
        drive_kind=rig.drive_kind,
        drive_unit=rig.drive_unit,
        limits={
            name: BenchLimit(unit=_LIMIT_UNITS[name], **section)
            for name, section in config.limits.model_dump().items()
        },
        channels={
            name: BenchChannel(unit=info.unit, rate_hz=info.rate_hz, delay_s=info.delay_s)
            for name, info in infos.items()
        },
    )
