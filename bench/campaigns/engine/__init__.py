"""Engine of campaigns: state, pure transitions, conditions, commands and edits."""

from bench.campaigns.engine.changes import start_campaign
from bench.campaigns.engine.commands import Choice, answer, parse_choice, pause, resume, stop
from bench.campaigns.engine.conditions import (
    compute_interval,
    get_half_width,
    group_runs,
    needs_diagnosis,
    needs_results,
    needs_thermometer,
)
from bench.campaigns.engine.edits import QueueEdit, apply_edit, collect_edit_methods, parse_edit
from bench.campaigns.engine.evaluation import is_awaiting_diagnosis
from bench.campaigns.engine.executions import find_spec, make_method
from bench.campaigns.engine.machine import advance, recover
from bench.campaigns.engine.observation import ExecutionReport, Observation
from bench.campaigns.engine.state import (
    Active,
    CampaignState,
    CampaignStatus,
    Execution,
    Item,
    Message,
    ParameterResult,
    RunFact,
    RunResult,
    Times,
)

__all__ = [
    "Active",
    "CampaignState",
    "CampaignStatus",
    "Choice",
    "Execution",
    "ExecutionReport",
    "Item",
    "Message",
    "Observation",
    "ParameterResult",
    "QueueEdit",
    "RunFact",
    "RunResult",
    "Times",
    "advance",
    "answer",
    "apply_edit",
    "collect_edit_methods",
    "compute_interval",
    "find_spec",
    "get_half_width",
    "group_runs",
    "is_awaiting_diagnosis",
    "make_method",
    "needs_diagnosis",
    "needs_results",
    "needs_thermometer",
    "parse_choice",
    "parse_edit",
    "pause",
    "recover",
    "resume",
    "start_campaign",
    "stop",
]
