"""The rig agent, its instruments, and whether everything is there."""

import asyncio
from importlib.metadata import version

from fastapi import APIRouter

from bench.agent.messages import AgentStatus, InstrumentStatus, PrepareCommand, StopCommand
from bench.errors import BenchError
from bench.service.desk import AtDesk
from bench.service.views import Health, Preparation

open_to_all = APIRouter(tags=["service"])
router = APIRouter(tags=["rig"])


@open_to_all.get("/health")
async def health(desk: AtDesk) -> Health:
    """Whether agent and worker are there; needs no token."""
    agent, worker = await asyncio.gather(asyncio.to_thread(_agent_words, desk), desk.engine.words())
    return Health(version=version("mrbench"), agent=agent, worker=worker)


def _agent_words(desk: AtDesk) -> str:
    try:
        desk.watch.status()
    except BenchError as error:
        return str(error)
    return "ok"


@router.get("/agent")
def agent(desk: AtDesk) -> AgentStatus:
    """What the agent says of itself."""
    return desk.watch.status()


@router.post("/agent/reset")
def reset(desk: AtDesk) -> AgentStatus:
    """Take back a trip whose cause has gone; nothing moves."""
    return desk.watch.reset()


@router.post("/agent/stop")
def stop(desk: AtDesk) -> AgentStatus:
    """End whatever goes on in good order: a run, or a step before one. Harmless when nothing moves."""
    return desk.watch.command(StopCommand())


@router.post("/agent/prepare")
def prepare(desk: AtDesk, wanted: Preparation) -> AgentStatus:
    """One step before a run; where the answer's state is `preparing`, it goes on."""
    return desk.watch.command(PrepareCommand(step=wanted.step, position_m=wanted.position_m))


@router.get("/instruments")
def instruments(desk: AtDesk) -> tuple[InstrumentStatus, ...]:
    """The instruments and their wires."""
    return desk.watch.status().instruments
