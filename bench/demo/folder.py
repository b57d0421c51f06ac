"""Files of the demonstration."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class DemoFolder:
    """Methods to record, and paths of all results."""

    path: Path
    method: str
    """Method of the recording for the fit."""
    validation_method: str | None
    """Method of the validation strokes; None to record none."""
    seed: int
    """Seed of the hidden effect."""
    further_methods: tuple[str, ...] = ()
    """Methods that are recorded afterwards if the service keeps running, so that it has three runs to explore."""

    @property
    def log(self) -> Path:
        """Recording for the fit."""
        return self.path / f"{self.method}.mcap"

    @property
    def validation_log(self) -> Path | None:
        """Recording of the validation strokes."""
        return None if self.validation_method is None else self.path / f"{self.validation_method}.mcap"

    @property
    def fit(self) -> Path:
        """Fit document."""
        return self.path / "fit.json"

    @property
    def prediction(self) -> Path | None:
        """Prediction of the validation strokes by the twin."""
        return None if self.validation_method is None else self.path / "prediction.json"

    @property
    def diagnosis(self) -> Path:
        """Diagnosis document."""
        return self.path / "diagnosis.json"

    @property
    def twin(self) -> Path:
        """Scenario of the damper with the named effects."""
        return self.path / "twin.json"

    @property
    def truth(self) -> Path:
        """Truth file of the simulated rig, which the demo opens last."""
        return self.path / "truth.json"

    @property
    def report(self) -> Path:
        """Report page."""
        return self.path / "report.html"

    @property
    def plots(self) -> Path:
        """Folder of the report's plots."""
        return self.path / "plots"

    @property
    def config(self) -> Path:
        """Configuration that the simulated rig writes, with the addresses of its instruments."""
        return self.path / "bench.toml"

    @property
    def data(self) -> Path:
        """Data folder of the service."""
        return self.path / "service"
