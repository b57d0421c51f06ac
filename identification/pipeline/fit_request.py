"""Request for a fit: samples to hold out, stages, budget and options."""

from dataclasses import dataclass, field

from identification.fitting import Budget, HoldOut, OptimiserSettings


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
    def network_budget(self) -> Budget:
        """Budget of the network: half of the processor time if an output-error fit follows."""
        return self.settings.budget.scale(0.5 if "refine" in self.stages else 1.0)

    @property
    def output_error_budget(self) -> Budget:
        """Budget of the output-error fit: half of the processor time if a network is trained as well."""
        return self.settings.budget.scale(0.5 if "pinn" in self.stages else 1.0)
