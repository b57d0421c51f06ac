"""The states of a drive, of a mounting, and of the stream of samples, without a bus."""

import numpy as np
import pytest

from drivers.actuator_samples import ActuatorSamples, Scale
from drivers.can_bus import pack_frame
from drivers.canopen_layout import Field, PdoLayout
from drivers.canopen_node import Emergency
from drivers.channel import Frame
from drivers.cia402 import DriveState, FaultKind, active_faults, drive_state, onward
from drivers.errors import Refused
from drivers.mounting import Mounting, found, step

MILLISECOND = 1_000_000


@pytest.mark.parametrize(
    ("statusword", "state"),
    [
        (0x0000, DriveState.NOT_READY),
        (0x0250, DriveState.SWITCH_ON_DISABLED),
        (0x0231, DriveState.READY),
        (0x0233, DriveState.SWITCHED_ON),
        (0x1237, DriveState.ENABLED),
        (0x0217, DriveState.QUICK_STOP),
        (0x021F, DriveState.FAULT_REACTION),
        (0x0218, DriveState.FAULT),
        (0x0041 | 0x0E, DriveState.NOT_READY),
    ],
)
def test_statusword_shows_the_state(statusword, state):
    assert drive_state(statusword) is state


def test_way_to_operation_is_step_by_step_and_a_fault_has_none():
    assert [onward(state) for state in (DriveState.SWITCH_ON_DISABLED, DriveState.READY)] == [0x06, 0x07]
    assert onward(DriveState.SWITCHED_ON) == 0x0F
    assert onward(DriveState.QUICK_STOP) == 0x00
    assert onward(DriveState.FAULT) is None


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (0x8250, FaultKind.STALE_SETPOINTS),
        (0x8130, FaultKind.MASTER_LOST),
        (0x8611, FaultKind.FOLLOWING_ERROR),
        (0x8612, FaultKind.TRAVEL_LIMIT),
        (0x2310, FaultKind.OVER_CURRENT),
        (0x3210, FaultKind.VOLTAGE),
        (0x4310, FaultKind.OVER_TEMPERATURE),
        (0x7320, FaultKind.POSITION_SENSOR),
        (0x8210, FaultKind.COMMUNICATION),
        (0xFF01, FaultKind.OTHER),
    ],
)
def test_emergency_becomes_a_named_fault(code, kind):
    (fault,) = active_faults([Emergency(code, 1, 7)])
    assert fault.kind is kind
    assert f"{code:04X}h" in str(fault)


def test_error_reset_takes_the_faults_back():
    assert active_faults([Emergency(0x8611, 1, 0), Emergency(0x0000, 0, 1)]) == ()


def test_specimen_is_homed_mounted_centred_in_this_order():
    mounting = Mounting.UNMOUNTED
    for verb, after in (("home", "homed"), ("mount", "mounted"), ("centre", "centred"), ("unmount", "homed")):
        mounting = step(mounting, verb)
        assert mounting.value == after


@pytest.mark.parametrize("mounting", [Mounting.MOUNTED, Mounting.CENTRED, Mounting.STRANDED])
def test_no_homing_with_a_specimen_clamped(mounting):
    with pytest.raises(Refused, match="specimen is clamped, and homing would drive it into its ends"):
        step(mounting, "home")


@pytest.mark.parametrize(
    ("mounting", "verb", "why"),
    [
        (Mounting.UNMOUNTED, "mount", "home it first"),
        (Mounting.UNMOUNTED, "centre", "home it"),
        (Mounting.HOMED, "centre", "mount it first"),
        (Mounting.CENTRED, "mount", "already mounted"),
        (Mounting.STRANDED, "mount", "reference is lost"),
        (Mounting.STRANDED, "centre", "reference is lost"),
    ],
)
def test_steps_out_of_turn_are_refused_with_the_reason(mounting, verb, why):
    with pytest.raises(Refused, match=why):
        step(mounting, verb)


def test_lost_reference_strands_a_clamped_specimen_until_it_is_taken_out():
    assert found(clamped=True, referenced=False) is Mounting.STRANDED
    assert step(Mounting.STRANDED, "unmount") is Mounting.UNMOUNTED
    assert found(clamped=True, referenced=True) is Mounting.MOUNTED
    assert found(clamped=False, referenced=True) is Mounting.HOMED
    assert found(clamped=False, referenced=False) is Mounting.UNMOUNTED


PLACE = PdoLayout(0x185, 8, True, (Field(0x6064, 0, 4, True), Field(0x1013, 4, 4, False)))
REST = PdoLayout(
    0x285, 8, True, (Field(0x6041, 0, 2, False), Field(0x6077, 2, 2, True), Field(0x606C, 4, 4, True))
)
UNSTAMPED = PdoLayout(0x185, 4, True, (Field(0x6064, 0, 4, True),))


class Wire:
    """Feeds a collector with frames as a drive would cause them."""

    def __init__(self, layouts=(PLACE, REST)) -> None:
        self.samples = ActuatorSamples(layouts, 5, Scale(1e-7, 1e-7, 1e-3), origin=0.001)
        self.stamped = layouts[0] is PLACE

    def sync(self, at: int) -> None:
        self.take(at * MILLISECOND, 0x80, b"", sent=True)

    def answer(self, at: int, count: int, device_us: int = 0, late: int = 0) -> None:
        stamp = (device_us % 2**32).to_bytes(4, "little") if self.stamped else b""
        place = count.to_bytes(4, "little", signed=True) + stamp
        self.take((at + late) * MILLISECOND, 0x185, place)
        self.take((at + late) * MILLISECOND, 0x285, b"\x37\x12" + b"\x0a\x00" + b"\x64\x00\x00\x00")

    def take(self, at_ns: int, identifier: int, data: bytes, sent: bool = False) -> None:
        self.samples.take(Frame(at_ns, sent, pack_frame(identifier, data)))

    def cycles(self, numbers, skip=(), late: int = 0) -> None:
        for k in numbers:
            self.sync(1000 + 4 * k)
            if k not in skip:
                self.answer(1000 + 4 * k, k, 4000 * k, late)

    def positions(self):
        return [block for block in self.samples.blocks() if block.channel == "actuator_position"]


def test_frames_of_one_sync_become_one_sample_in_si_units():
    wire = Wire()
    wire.sync(1000)
    wire.answer(1000, -50_000, 7)
    position, velocity, torque = wire.samples.blocks()
    assert position.values[0] == pytest.approx(-0.006)
    assert position.raw[0] == -50_000
    assert velocity.values[0] == pytest.approx(1e-5)
    assert torque.values[0] == pytest.approx(0.01)
    assert list(position.device_ns) == [7000]
    assert position.quality == "good"
    assert wire.samples.statusword == 0x1237


def test_drive_without_a_clock_gives_uncertain_samples():
    wire = Wire((UNSTAMPED, REST))
    wire.cycles(range(3))
    (block,) = wire.positions()
    assert block.device_ns is None
    assert block.quality == "uncertain"


def test_device_clock_goes_on_over_its_wrapping():
    wire = Wire()
    for k in range(4):
        wire.sync(1000 + 4 * k)
        wire.answer(1000 + 4 * k, 0, 2**32 - 6000 + 4000 * k)
    (block,) = wire.positions()
    assert list(np.diff(block.device_ns)) == [4 * MILLISECOND] * 3


def test_half_a_sample_is_never_completed_by_the_next():
    wire = Wire()
    wire.sync(1000)
    wire.take(1000 * MILLISECOND, 0x285, b"\x37\x12" + b"\x0a\x00" + b"\x64\x00\x00\x00")
    wire.sync(1004)
    wire.take(1004 * MILLISECOND, 0x185, bytes(8))
    wire.sync(1008)
    wire.answer(1008, 77)
    (block,) = wire.positions()
    assert list(block.raw) == [77]


def test_unanswered_syncs_are_lost_and_the_number_leaps():
    wire = Wire()
    wire.cycles(range(200), skip={50, 51, 52})
    blocks = wire.positions()
    assert wire.samples.lost == 3
    assert wire.samples.received == 197
    assert blocks[0].first == 0
    assert blocks[-1].first + len(blocks[-1].values) == 200


def test_late_answers_are_not_lost():
    wire = Wire()
    events = []
    for k in range(300):
        late = 21 if k >= 100 else 0
        events += [(1000 + 4 * k, 0, k), (1000 + 4 * k + late, 1, k)]
    for at, answer, k in sorted(events):
        if answer:
            wire.answer(at, k, 4000 * k)
        else:
            wire.sync(at)
    blocks = wire.positions()
    assert sum(len(block.values) for block in blocks) == 300
    assert wire.samples.lost == 0
    assert wire.samples.received == 300


def test_answers_to_nobody_and_cut_ones_are_not_used():
    wire = Wire()
    wire.answer(1000, 1)
    wire.sync(1004)
    wire.take(1004 * MILLISECOND, 0x185, bytes(7))
    assert wire.samples.blocks() == []
    assert wire.samples.corrupted == 1


def test_restarted_drive_begins_its_clock_anew():
    wire = Wire()
    wire.cycles(range(1000, 1010))
    wire.take(5000 * MILLISECOND, 0x705, b"\x00")
    wire.sync(6000)
    wire.answer(6000, 1, 10)
    blocks = wire.positions()
    assert blocks[-1].device_ns[-1] == 10_000


def test_demanded_frame_holds_its_objects_and_zero_for_the_rest():
    layout = PdoLayout(
        0x205, 7, True, (Field(0x6040, 0, 2, False), Field(0x6060, 2, 1, True), Field(0x607A, 3, 4, True))
    )
    assert layout.packed({0x6040: 0x1F, 0x607A: -2}) == b"\x1f\x00" + b"\x00" + b"\xfe\xff\xff\xff"
    with pytest.raises(OverflowError):
        layout.packed({0x6040: 1 << 16})
