"""Run executor with real limits, supervision and log, on doubles of actuator and amplifier."""

import tomllib

import numpy as np

from bench.agent.run_executor import RunExecutor
from bench.agent.supervisor import SafetySupervisor
from bench.agent.timing import AgentTiming
from bench.agent_protocol import RunCommand
from bench.config import BenchConfig
from bench.errors import InterlockError
from bench.rig.acquisition import Acquisition, Batch
from bench.rig.instruments import build_rig
from bench.safety.interlocks import Interlocks
from bench.sequencer.sequencer import Sequencer
from drivers.channel import SampleBlock
from tests.support.fake_rig import BENCH_TOML, EventLog, FakeActuator, FakeAmplifier, FakeRecordingThread
from tests.support.methods import constant, method_document, sine

NO_WAITING = AgentTiming(clock_settling=0.0, final_samples=0.0, setup_reply=0.05)
METHOD = method_document(
    sine("a", 0.002, 10.0, constant(0.2), fade_s=0.05, cycles=1),
    stroke_m=0.01, velocity_mps=0.5, acceleration_mps2=30.0,
)  # fmt: skip
"""Its limits are 10 mm and 900 N; those of the fixture 55 mm and 5000 N."""


class RigDoubles:
    """Doubles of the instruments that a run moves."""

    def __init__(self, **actuator):
        self.calls = []
        self.actuator = FakeActuator(self.calls, **actuator)
        self.amplifier = FakeAmplifier(self.calls)


class RunBench:
    """Run executor on a rig whose wires are never opened.

    Args:
        folder: folder of the configuration and the logs.
        clock: bench clock [ns].
        toml: configuration of the bench.
        actuator: settings of the actuator's double.
    """

    def __init__(self, folder, clock, toml=BENCH_TOML, **actuator):
        config = BenchConfig.model_validate(tomllib.loads(toml))
        self.toml, self.clock, self.run = folder / "bench.toml", clock, None
        self.toml.write_text(toml)
        self.rig, self.doubles, self.events = (
            build_rig(config, clock, realtime=True),
            RigDoubles(**actuator),
            EventLog(),
        )
        self.interlocks = Interlocks(config.limits.make_limit_matrix(), "coil_voltage")
        self.acquisition = Acquisition(
            {one.name: one.instrument for one in self.rig.instruments}, lambda batch: None, lambda *failure: None
        )
        self.acquisition.enable_reconnection()
        self.supervisor = SafetySupervisor(
            self.doubles, self.interlocks, clock, self.acquisition.maps, self.events, self.stop
        )
        self.executor = RunExecutor(
            config, self.toml, self.rig, self.interlocks, self.supervisor, self.acquisition, FakeRecordingThread(),
            clock, self.events, NO_WAITING,
        )  # fmt: skip

    def prepare(self, play, log):
        """Prepare a run whose sequencer calls a function with the run's supervision instead of playing."""
        prepared = self.executor.prepare(RunCommand(method=METHOD, log=str(log)))
        prepared.run.sequencer.run = lambda programme: play(prepared.supervision)
        self.run = prepared.run
        return prepared

    def prepare_playback(self, log):
        """Prepare a run that is played on the doubles."""
        prepared = self.executor.prepare(RunCommand(method=METHOD, log=str(log)))
        self.run, doubles = prepared.run, self.doubles
        self.run.sequencer = Sequencer(
            doubles.actuator, doubles.amplifier, self.interlocks, self.run.history, self.clock,
            prepared.supervision, lambda: 0.0,
        )  # fmt: skip
        return prepared

    def stop(self, reason, hold=False):
        """Stop the run as the agent does."""
        self.run.sequencer.stop(reason, hold)

    def receive_force(self, force):
        """Pass a force sample [N] to the supervision."""
        values = np.array([force])
        block = SampleBlock("force", 0, None, self.clock(), values, values, "good")
        self.supervisor.on_samples(Batch("cell", (block,)))

    def is_permitted(self, position):
        """Return whether a setpoint [m] is permitted."""
        try:
            self.interlocks.permit(position=position)
        except InterlockError:
            return False
        return True
