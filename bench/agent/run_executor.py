"""Run executor: prepares a run from a command and executes it under the limits that apply to it."""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from bench.agent.run import Run
from bench.agent.run_request import RunRequest, validate_request
from bench.agent.run_supervision import RunSupervision
from bench.agent.supervisor import SafetySupervisor
from bench.agent.timing import OPERATION_TIMING, AgentTiming
from bench.agent_protocol import RunCommand
from bench.calibration import choose_current, list_failed, list_overdue, make_check_record, read_failed
from bench.checks import CHECKED_CHANNELS, find_check_kind
from bench.config import BenchConfig
from bench.disk import check_space, estimate_log_size, find_free_space
from bench.errors import RunError
from bench.log import RunHeader
from bench.recorder import (
    EventReporter,
    LogMetadata,
    RecordingThread,
    describe_clocks,
    describe_decoders,
    make_attachments,
    make_run_header,
)
from bench.rig import PRIORITY_STEP, Acquisition, Rig, pause_collection, raise_priority
from bench.safety import Interlocks, make_specimen_matrix, merge_limits
from bench.sequencer import CommandHistory, Sequencer, check_shunt
from drivers import Clock

_CLOCK_RATE_TIME = 20.0
"""[s] Time until the rate of a device's clock is known to a few ppm; until then the nominal rate is used."""


class PreparedRun(NamedTuple):
    """Run that is ready to be executed."""

    run: Run
    metadata: LogMetadata
    supervision: RunSupervision


class RunExecutor:
    """Executor of runs on the instruments of the agent.

    Args:
        config: configuration of the bench.
        source: file of the configuration, attached to every log; logs are stored beside it.
        rig: the instruments.
        interlocks: limits of the bench.
        supervisor: applies the actions of exceeded limits.
        acquisition: reads the instruments.
        recording_thread: records the samples.
        clock: bench clock [ns].
        report_event: receives the events of runs.
        timing: waiting times.
    """

    def __init__(
        self,
        config: BenchConfig,
        source: Path | None,
        rig: Rig,
        interlocks: Interlocks,
        supervisor: SafetySupervisor,
        acquisition: Acquisition,
        recording_thread: RecordingThread,
        clock: Clock,
        report_event: EventReporter,
        timing: AgentTiming = OPERATION_TIMING,
    ) -> None:
        self._config, self._source, self._rig = config, source, rig
        self._interlocks, self._supervisor, self._acquisition = interlocks, supervisor, acquisition
        self._recording_thread, self._clock, self._report_event = recording_thread, clock, report_event
        self._timing = timing
        self._connected_ns = 0

    def note_connection(self) -> None:
        """Take the present time as that at which the wires were opened."""
        self._connected_ns = self._clock()

    def prepare(self, command: RunCommand) -> PreparedRun:
        """Prepare the run of a command; nothing moves.

        Raises:
            MethodError, RunError: it cannot be executed, the load cell cannot switch a shunt that it needs, the
                disk has no room for its log, or a calibration is overdue or a check has failed, and the
                configuration refuses that.
        """
        request = validate_request(command, self._rig, self._config.rig.specimen, self._find_log_folder())
        metadata = self._describe(request, command)
        request = replace(
            request,
            overdue=tuple(list_overdue(metadata.header.calibration)),
            failed_checks=tuple(read_failed(metadata.header.checks)),
        )
        self._check_calibration(request)
        check_space(find_free_space(request.path.parent), _estimate_log_size(request, metadata.header))
        method, history = request.method, CommandHistory()
        limits = merge_limits(self._interlocks.limits, make_specimen_matrix(method))
        check_shunt(request.programme, self._rig.load_cell, limits)
        supervision = RunSupervision(
            method, history, self._interlocks, self._supervisor, self._acquisition, self._clock, self._report_event
        )
        sequencer = Sequencer(
            self._rig.actuator,
            self._rig.amplifier,
            self._interlocks,
            history,
            self._clock,
            supervision,
            self._estimate_amplifier_rate,
            load_cell=self._rig.load_cell,
        )
        run = Run(
            request, history, sequencer, self._recording_thread, self._clock, self._report_event, self._timing
        )
        return PreparedRun(run, metadata, supervision)

    def _describe(self, request: RunRequest, command: RunCommand) -> LogMetadata:
        """Return the content of the log apart from samples, marks and events."""
        method, maps = request.method, self._acquisition.maps
        certificates = choose_current(command.certificates, request.identity.started.date())
        header = make_run_header(
            method, request.identity, self._config, self._rig, maps, self._clock(), certificates
        )
        header = header.model_copy(
            update={
                "continues": request.continues,
                "resumed_after": request.resumed_after,
                "checks": self._describe_checks(request, command),
            }
        )
        return LogMetadata(
            header,
            # Read before anything moves, so that a missing certificate is reported in time.
            make_attachments(method, self._config, self._rig, self._source, certificates),
            partial(describe_decoders, self._rig),
            partial(describe_clocks, self._rig, maps),
        )

    def _describe_checks(self, request: RunRequest, command: RunCommand) -> dict[str, str]:
        """Return the latest check of each channel; none for a run that is a check itself."""
        if find_check_kind(request.method.name) is not None:
            return {}
        interval = self._config.calibration.check_interval_days
        failed = list_failed(command.checks, CHECKED_CHANNELS, request.identity.started, interval)
        return make_check_record(command.checks, failed)

    def _check_calibration(self, request: RunRequest) -> None:
        if request.overdue and self._config.calibration.overdue == "refuse":
            raise RunError(
                f"the run was refused: {'; '.join(request.overdue)}; calibrate the channel and add its "
                'certificate, or set overdue = "mark" in section [calibration] of bench.toml'
            )
        if request.failed_checks and self._config.calibration.failed_check == "refuse":
            raise RunError(
                f"the run was refused: {'; '.join(request.failed_checks)}; find the cause and repeat the check, "
                'or set failed_check = "mark" in section [calibration] of bench.toml'
            )

    def execute(self, prepared: PreparedRun) -> None:
        """Play and record a run to its end; afterwards the bench's own limits apply again."""
        self._wait_for_clocks()
        with prepared.supervision, pause_collection():
            raise_priority(-PRIORITY_STEP)
            prepared.run.execute(prepared.metadata, self._supervisor.wait_until_stopped, self._acquisition.maps)

    def _wait_for_clocks(self) -> None:
        """Wait until the clocks of the devices were read often enough since the wires were opened."""
        remaining = self._connected_ns + round(self._timing.clock_settling * 1e9) - self._clock()
        time.sleep(max(remaining * 1e-9, 0.0))

    def _estimate_amplifier_rate(self) -> float:
        """Return the relative rate deviation of the amplifier's clock; 0 until it is known."""
        is_known = self._clock() - self._connected_ns >= _CLOCK_RATE_TIME * 1e9
        return self._acquisition.maps[self._rig.amplifier.name].estimate_rate() if is_known else 0.0

    def _find_log_folder(self) -> Path:
        return find_log_folder(self._config, self._source)


def find_log_folder(config: BenchConfig, source: Path | None) -> Path:
    """Return the folder of the logs.

    Args:
        config: configuration of the bench.
        source: file of the configuration; None without one.
    """
    return (Path() if source is None else source.parent) / config.rig.folder


def _estimate_log_size(request: RunRequest, header: RunHeader) -> int:
    """Return the largest expected size of the log [byte]."""
    # The drive repeats the channel that measures it.
    rates = (channel.rate_hz for name, channel in header.channels.items() if name != "coil_drive")
    return estimate_log_size(request.programme.duration, rates)
