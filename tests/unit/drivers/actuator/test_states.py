"""Drive states, faults, reference states and decoding of samples, without a bus."""

import numpy as np
import pytest

from drivers.actuator.cia402 import (
    DriveState,
    FaultKind,
    decode_drive_state,
    find_active_faults,
    find_next_control_word,
)
from drivers.actuator.reference_state import ReferenceState, apply_transition, find_initial_state
from drivers.actuator.sample_decoder import ActuatorDecoder, CountScale
from drivers.channel import Frame
from drivers.errors import RefusedError
from drivers.transport.can_bus import pack_frame
from drivers.transport.canopen_node import Emergency
from drivers.transport.canopen_pdo import PdoField, PdoMapping

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
    assert decode_drive_state(statusword) is state


def test_operation_is_reached_step_by_step_but_not_from_a_fault():
    assert find_next_control_word(DriveState.SWITCH_ON_DISABLED) == 0x06
    assert find_next_control_word(DriveState.READY) == 0x07
    assert find_next_control_word(DriveState.SWITCHED_ON) == 0x0F
    assert find_next_control_word(DriveState.QUICK_STOP) == 0x00
    assert find_next_control_word(DriveState.FAULT) is None


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
    (fault,) = find_active_faults([Emergency(code, 1, 7)])
    assert fault.kind is kind
    assert f"{code:04X}h" in str(fault)


def test_error_reset_takes_the_faults_back():
    assert find_active_faults([Emergency(0x8611, 1, 0), Emergency(0x0000, 0, 1)]) == ()


def test_specimen_is_homed_mounted_centred_in_this_order():
    state = ReferenceState.UNREFERENCED
    for step, after in (("home", "homed"), ("mount", "mounted"), ("centre", "centred"), ("unmount", "homed")):
        state = apply_transition(state, step)
        assert state.value == after


@pytest.mark.parametrize("state", [ReferenceState.MOUNTED, ReferenceState.CENTRED, ReferenceState.REFERENCE_LOST])
def test_no_homing_with_a_specimen_clamped(state):
    with pytest.raises(RefusedError, match="specimen is clamped, and homing would drive it into its ends"):
        apply_transition(state, "home")


@pytest.mark.parametrize(
    ("state", "step", "reason"),
    [
        (ReferenceState.UNREFERENCED, "mount", "home it first"),
        (ReferenceState.UNREFERENCED, "centre", "home it"),
        (ReferenceState.HOMED, "centre", "mount it first"),
        (ReferenceState.CENTRED, "mount", "already mounted"),
        (ReferenceState.REFERENCE_LOST, "mount", "reference is lost"),
        (ReferenceState.REFERENCE_LOST, "centre", "reference is lost"),
    ],
)
def test_steps_out_of_order_are_refused_with_the_reason(state, step, reason):
    with pytest.raises(RefusedError, match=reason):
        apply_transition(state, step)


def test_a_lost_reference_needs_the_specimen_unmounted():
    assert find_initial_state(clamped=True, referenced=False) is ReferenceState.REFERENCE_LOST
    assert apply_transition(ReferenceState.REFERENCE_LOST, "unmount") is ReferenceState.UNREFERENCED
    assert find_initial_state(clamped=True, referenced=True) is ReferenceState.MOUNTED
    assert find_initial_state(clamped=False, referenced=True) is ReferenceState.HOMED
    assert find_initial_state(clamped=False, referenced=False) is ReferenceState.UNREFERENCED


POSITION = PdoMapping(0x185, 8, True, (PdoField(0x6064, 0, 4, True), PdoField(0x1013, 4, 4, False)))
STATUS = PdoMapping(
    0x285, 8, True, (PdoField(0x6041, 0, 2, False), PdoField(0x6077, 2, 2, True), PdoField(0x606C, 4, 4, True))
)
WITHOUT_CLOCK = PdoMapping(0x185, 4, True, (PdoField(0x6064, 0, 4, True),))


class Wire:
    """Feeds a decoder with the frames of a drive."""

    def __init__(self, mappings=(POSITION, STATUS)) -> None:
        self.decoder = ActuatorDecoder(mappings, 5, CountScale(1e-7, 1e-7, 1e-3), origin=0.001)
        self.has_clock = mappings[0] is POSITION

    def sync(self, at: int) -> None:
        self.add(at * MILLISECOND, 0x80, b"", sent=True)

    def reply(self, at: int, count: int, device_us: int = 0, late: int = 0) -> None:
        clock = (device_us % 2**32).to_bytes(4, "little") if self.has_clock else b""
        position = count.to_bytes(4, "little", signed=True) + clock
        self.add((at + late) * MILLISECOND, 0x185, position)
        self.add((at + late) * MILLISECOND, 0x285, b"\x37\x12" + b"\x0a\x00" + b"\x64\x00\x00\x00")

    def add(self, at_ns: int, identifier: int, data: bytes, sent: bool = False) -> None:
        self.decoder.add_frame(Frame(at_ns, sent, pack_frame(identifier, data)))

    def cycles(self, numbers, skip=(), late: int = 0) -> None:
        for k in numbers:
            self.sync(1000 + 4 * k)
            if k not in skip:
                self.reply(1000 + 4 * k, k, 4000 * k, late)

    def positions(self):
        return [block for block in self.decoder.pop_blocks() if block.channel == "actuator_position"]


def test_frames_of_one_sync_become_one_sample_in_si_units():
    wire = Wire()
    wire.sync(1000)
    wire.reply(1000, -50_000, 7)
    position, velocity, torque = wire.decoder.pop_blocks()
    assert position.values[0] == pytest.approx(-0.006)
    assert position.raw[0] == -50_000
    assert velocity.values[0] == pytest.approx(1e-5)
    assert torque.values[0] == pytest.approx(0.01)
    assert list(position.device_ns) == [7000]
    assert position.quality == "good"
    assert wire.decoder.statusword == 0x1237


def test_drive_without_a_clock_gives_uncertain_samples():
    wire = Wire((WITHOUT_CLOCK, STATUS))
    wire.cycles(range(3))
    (block,) = wire.positions()
    assert block.device_ns is None
    assert block.quality == "uncertain"


def test_the_device_clock_is_unwrapped():
    wire = Wire()
    for k in range(4):
        wire.sync(1000 + 4 * k)
        wire.reply(1000 + 4 * k, 0, 2**32 - 6000 + 4000 * k)
    (block,) = wire.positions()
    assert list(np.diff(block.device_ns)) == [4 * MILLISECOND] * 3


def test_an_incomplete_sample_is_not_completed_by_the_next():
    wire = Wire()
    wire.sync(1000)
    wire.add(1000 * MILLISECOND, 0x285, b"\x37\x12" + b"\x0a\x00" + b"\x64\x00\x00\x00")
    wire.sync(1004)
    wire.add(1004 * MILLISECOND, 0x185, bytes(8))
    wire.sync(1008)
    wire.reply(1008, 77)
    (block,) = wire.positions()
    assert list(block.raw) == [77]


def test_syncs_without_a_sample_are_lost_and_the_number_skips_them():
    wire = Wire()
    wire.cycles(range(200), skip={50, 51, 52})
    blocks = wire.positions()
    assert wire.decoder.lost == 3
    assert wire.decoder.received == 197
    assert blocks[0].first == 0
    assert blocks[-1].first + len(blocks[-1].values) == 200


def test_late_samples_are_not_lost():
    wire = Wire()
    events = []
    for k in range(300):
        late = 21 if k >= 100 else 0
        events += [(1000 + 4 * k, 0, k), (1000 + 4 * k + late, 1, k)]
    for at, is_reply, k in sorted(events):
        if is_reply:
            wire.reply(at, k, 4000 * k)
        else:
            wire.sync(at)
    blocks = wire.positions()
    assert sum(len(block.values) for block in blocks) == 300
    assert wire.decoder.lost == 0
    assert wire.decoder.received == 300


def test_unrequested_and_truncated_frames_are_not_used():
    wire = Wire()
    wire.reply(1000, 1)
    wire.sync(1004)
    wire.add(1004 * MILLISECOND, 0x185, bytes(7))
    assert wire.decoder.pop_blocks() == []
    assert wire.decoder.corrupted == 1


def test_the_clock_of_a_restarted_drive_begins_again():
    wire = Wire()
    wire.cycles(range(1000, 1010))
    wire.add(5000 * MILLISECOND, 0x705, b"\x00")
    wire.sync(6000)
    wire.reply(6000, 1, 10)
    blocks = wire.positions()
    assert blocks[-1].device_ns[-1] == 10_000


def test_a_packed_frame_contains_its_objects_and_zero_for_the_others():
    mapping = PdoMapping(
        0x205, 7, True, (PdoField(0x6040, 0, 2, False), PdoField(0x6060, 2, 1, True), PdoField(0x607A, 3, 4, True))
    )
    assert mapping.pack({0x6040: 0x1F, 0x607A: -2}) == b"\x1f\x00" + b"\x00" + b"\xfe\xff\xff\xff"
    with pytest.raises(OverflowError):
        mapping.pack({0x6040: 1 << 16})


def test_the_drives_clock_is_read_between_the_request_and_its_reply():
    """A frame lasts 108 us, by which the clock was read after the begin and before the end."""
    wire = Wire()
    wire.cycles([1])
    wire.add(1_010_000_000, 0x605, b"\x40\x13\x10\x00" + bytes(4), sent=True)
    wire.add(1_012_000_000, 0x585, b"\x43\x13\x10\x00" + (9_500).to_bytes(4, "little"))
    wire.decoder.decode_pending()
    assert wire.decoder.clock_reading == (9_500_000, 1_010_108_000, 1_011_892_000)
    assert wire.decoder.last_ns == 1_004 * MILLISECOND


def test_a_clock_reply_faster_than_two_frames_is_an_instant():
    wire = Wire()
    wire.add(1_000_000, 0x605, b"\x40\x13\x10\x00", sent=True)
    wire.add(1_150_000, 0x585, b"\x43\x13\x10\x00\x07\x00\x00\x00")
    wire.decoder.decode_pending()
    assert wire.decoder.clock_reading == (7_000, 1_108_000, 1_108_000)


@pytest.mark.parametrize(
    "frames",
    [
        [(0x585, b"\x43\x13\x10\x00\x07\x00\x00\x00")],  # not requested
        [(0x605, b"\x40\x13\x10\x00"), (0x585, b"\x43\x14\x10\x00\x07\x00\x00\x00")],
        [(0x605, b"\x40\x14\x10\x00"), (0x585, b"\x43\x13\x10\x00\x07\x00\x00\x00")],
    ],
)
def test_the_reply_of_another_object_is_not_a_clock_reading(frames):
    wire = Wire()
    for identifier, data in frames:
        wire.add(1_000_000, identifier, data)
    wire.decoder.decode_pending()
    assert wire.decoder.clock_reading is None


@pytest.mark.parametrize(("step", "accepted"), [(2**31, 2), (2**31 + 1, 1)])
def test_a_clock_that_went_backwards_gives_no_sample(step, accepted):
    wire = Wire()
    for at, device_us in ((1000, 500), (1004, 500 + step)):
        wire.sync(at)
        wire.reply(at, 0, device_us)
    wire.decoder.decode_pending()
    assert wire.decoder.received == accepted
