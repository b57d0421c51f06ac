"""Operations of the servo drive on a double of its CANopen node: what is written, and when waiting ends."""

from types import SimpleNamespace

import pytest

from drivers.actuator.cia402 import DriveState
from drivers.actuator.servo_drive import ActuatorSettings, ServoDrive
from drivers.errors import InvalidReplyError, NoReplyError, OutOfRangeError, RefusedError
from drivers.transport.canopen_node import Emergency

DISABLED, READY, ON, ENABLED, QUICK_STOP, FAULT_REACTION, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08
HOMED = 0x9027
"""Statusword: operation enabled, homing attained, position referenced."""


class Node:
    """Drive with the given objects; a controlword changes its state as CiA 402 demands."""

    def __init__(self, statusword=DISABLED, speed=0, ramps=True):
        self.objects = {
            0x1000: 0x0002_0192, 0x60A8: 0xF9010000, 0x60A9: 0xF9010300, 0x6076: 640, 0x6041: statusword,
            0x606C: speed,
        }  # fmt: skip
        self.written, self.commands, self.emergencies, self.ramps = {}, [], [], ramps
        self.heartbeat = SimpleNamespace(
            wait_for_next=lambda timeout: self.commands.append(("heartbeat", timeout))
        )

    def read_number(self, index):
        return self.objects[index]

    def write_verified(self, index, value, sub=0):
        self.written[index, sub] = value

    def download(self, index, value, sub=0):
        self.written[index, sub] = value
        if index == 0x6040:
            self.commands.append(value)
            after = {0x06: READY, 0x07: ON, 0x0F: ENABLED, 0x00: DISABLED, 0x1F: HOMED}
            if self.ramps:
                after[0x02] = QUICK_STOP
            self.objects[0x6041] = after.get(value, self.objects[0x6041])

    def command_state(self, state, timeout):
        self.commands.append(("state", state))

    def set_up_process_data(self):
        self.commands.append("mapping")


def make_drive(*arguments, **options):
    node = Node(*arguments, **options)
    return ServoDrive("rod", node), node


def test_limits_are_written_in_the_counts_of_the_drive():
    drive, node = make_drive()
    drive.configure(ActuatorSettings(cycle=0.005, travel=(-0.03, 0.045), torque_limit=1.6))
    assert node.written == {
        (0x1016, 1): 0,
        (0x6040, 0): 0,
        (0x1017, 0): 50,  # ms
        (0x1006, 0): 5000,  # us
        (0x60C2, 1): 5,
        (0x60C2, 2): -3,  # ms
        (0x1400, 5): 50,  # ms
        (0x6007, 0): 3,
        (0x605A, 0): 6,
        (0x607D, 1): -300_000,  # 0.1 um
        (0x607D, 2): 450_000,
        (0x607F, 0): 10_000_000,  # twice 0.5 m/s
        (0x6065, 0): 50_000,
        (0x6067, 0): 1_000,
        (0x6072, 0): 2_500,  # per mille of 0.64 N m
    }
    assert drive.rated_torque == pytest.approx(0.64)
    assert node.commands == [("heartbeat", 1.0), ("state", 127), "mapping", ("state", 5), 0x00]


@pytest.mark.parametrize("cycle", [0.001, 0.004, 0.020])
def test_cycles_of_whole_milliseconds_are_accepted(cycle):
    drive, node = make_drive()
    drive.configure(ActuatorSettings(cycle=cycle))
    assert node.written[0x1006, 0] == round(cycle * 1e6)


@pytest.mark.parametrize(("cycle", "text"), [(0.0, "0"), (0.021, "21"), (0.0045, "4.5"), (0.00401, "4.01")])
def test_other_cycles_are_refused_before_a_limit_is_written(cycle, text):
    drive, node = make_drive()
    with pytest.raises(OutOfRangeError, match=f"cycle {text} ms; whole milliseconds from 1 to 20"):
        drive.configure(ActuatorSettings(cycle=cycle))
    assert (0x1006, 0) not in node.written


@pytest.mark.parametrize(
    ("index", "value", "message"),
    [
        (0x1000, 0x0002_0191, "not a CiA 402 drive"),
        (0x60A8, 0xFA010000, "60A8h reads FA010000h, not F9010000h"),
        (0x6076, -1, "rated torque"),
    ],
)
def test_another_device_is_refused(index, value, message):
    drive, node = make_drive()
    node.objects[index] = value
    with pytest.raises(InvalidReplyError, match=message):
        drive.configure(ActuatorSettings())


def test_a_rated_torque_of_one_step_is_accepted():
    drive, node = make_drive()
    node.objects[0x6076] = 1
    drive.configure(ActuatorSettings(torque_limit=0.5))
    assert node.written[0x6072, 0] == 500_000


def test_operation_is_enabled_with_the_masters_heartbeat_monitored():
    drive, node = make_drive()
    drive.enable_operation(127, ActuatorSettings(master_heartbeat_timeout=0.1))
    assert node.written[0x6060, 0] == 8
    assert node.written[0x1016, 1] == 0x7F0064  # node 127, 100 ms
    assert node.commands == [0x06, 0x07, 0x0F]


def test_a_drive_with_a_fault_is_not_switched_on():
    drive, node = make_drive()
    node.emergencies = [Emergency(0x8611, 1, 0)]
    with pytest.raises(RefusedError, match=r"the rod did not follow.*find the cause, then reset"):
        drive.enable_operation(127, ActuatorSettings())
    assert node.commands == []


@pytest.mark.parametrize(
    ("statusword", "commands"),
    [(ENABLED, [0x02]), (QUICK_STOP, [0x02]), (FAULT_REACTION, []), (DISABLED, []), (READY, []), (FAULT, [])],
)
def test_only_a_drive_in_operation_receives_a_quick_stop(statusword, commands):
    drive, node = make_drive(statusword)
    drive.stop(10.0)
    assert node.commands == commands
    assert node.written[0x1016, 1] == 0


@pytest.mark.parametrize("counts", [20_000, -20_000, 30_000])
def test_a_rod_at_two_millimetres_per_second_is_not_at_rest(counts):
    drive, _ = make_drive(ENABLED, counts)
    with pytest.raises(NoReplyError, match=r"waited 0 s for the rod to come to rest; .*quick stop active"):
        drive.stop(0.0)


@pytest.mark.parametrize("counts", [19_999, -19_999])
def test_a_slower_rod_is_at_rest(counts):
    drive, node = make_drive(ENABLED, counts)
    drive.stop(0.0)
    assert node.written[0x1016, 1] == 0


def test_a_slow_rod_in_operation_is_not_at_rest():
    drive, _ = make_drive(ENABLED, ramps=False)
    with pytest.raises(NoReplyError, match="state is operation enabled"):
        drive.stop(0.0)


def test_a_moving_rod_with_a_fault_reaction_is_waited_for():
    drive, _ = make_drive(FAULT_REACTION, 20_000)
    with pytest.raises(NoReplyError):
        drive.stop(0.0)


def test_a_reset_is_a_pulse_and_removes_the_faults():
    drive, node = make_drive()
    node.emergencies = [Emergency(0x8611, 1, 0)]
    drive.reset()
    assert node.commands == [0x00, 0x80, 0x00]
    assert drive.faults == ()


def test_homing_writes_its_method_and_ends_switched_off():
    drive, node = make_drive()
    drive.home(17, 10.0)
    assert (node.written[0x6098, 0], node.written[0x6060, 0]) == (17, 6)
    assert node.commands == [0x06, 0x07, 0x0F, 0x1F, 0x00]


@pytest.mark.parametrize(
    ("statusword", "done"),
    [(0x9027, True), (0x1027, False), (0x8027, False), (0x0027, False)],
)
def test_homing_is_done_when_attained_and_referenced(statusword, done):
    drive, _ = make_drive(statusword)
    assert drive._is_homed() is done
    assert drive.is_referenced() is bool(statusword & 0x8000)


@pytest.mark.parametrize(
    ("statusword", "message"),
    [(0xB027, r"ended in an error \(statusword B027h\)"), (0x9007, "interrupted, the drive is quick stop active")],
)
def test_homing_that_fails_is_refused(statusword, message):
    drive, _ = make_drive(statusword)
    with pytest.raises(RefusedError, match=message):
        drive._is_homed()


def test_a_drive_with_a_fault_counts_as_switched_off():
    drive, node = make_drive(FAULT)
    node.objects[0x6041] = FAULT
    node.download = lambda index, value, sub=0: None
    drive.switch_off()
    assert drive.read_state() is DriveState.FAULT
