"""Request for a fit: samples to hold out, stages, budget and options."""

from dataclasses import dataclass, field

from identification.fitting import HoldOut, OptimiserSettings


@dataclass(frozen=True)
class FitRequest:
    """Request for a fit."""

    hold_out: HoldOut = field(default_factory=HoldOut)
    delay_prior: float | None = None
    """Standard deviation of the channel delays beyond what the log reports [s]; None takes the log's clocks."""
    settings: OptimiserSettings = field(default_factory=OptimiserSettings)
    stages: tuple[str, ...] = ("refine",)
    """Stages ``pinn`` and ``refine``; with both, the fit is that of ``refine`` and ``pinn`` is its cross-check."""
    preset: str = "elements"
    """Preset of the network, or path of its settings."""
    per_log: tuple[str, ...] = ()
    """Per-log parameters of each further log: ``offset``, ``viscosity``."""
    profile: bool = False
    """True to compute intervals by profile likelihood as well."""

    @property
    def network_budget(self) -> float | None:
        """Processor time for the network [s]: half of the budget if an output-error fit follows."""
        budget = self.settings.budget
        return 0.5 * budget if budget is not None and "refine" in self.stages else budget

    @property
    def output_error_budget(self) -> float | None:
        """Processor time for the output-error fit [s]: half of the budget if a network is trained as well."""
        budget = self.settings.budget
        share = 0.5 if "pinn" in self.stages else 1.0
        return None if budget is None else share * budget
