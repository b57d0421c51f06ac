"""Benches that execute campaigns: the rig agent, and the simulated plant faster than real time."""

from bench.campaigns.benches.agent_bench import AgentBench, Thermometer
from bench.campaigns.benches.plant_bench import PlantBench
from bench.campaigns.benches.protocol import AgentConnection, CampaignBench
from bench.campaigns.benches.results import read_result

__all__ = ["AgentBench", "AgentConnection", "CampaignBench", "PlantBench", "Thermometer", "read_result"]
