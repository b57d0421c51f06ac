"""Result of a diagnosis: its documents."""

from dataclasses import dataclass

from identification.documents import Diagnosis, Twin


@dataclass(frozen=True)
class DiagnosisResult:
    """Documents of a diagnosis."""

    diagnosis: Diagnosis
    twin: Twin

    def rename_discovery(self, name: str) -> "DiagnosisResult":
        """Return the result with another name of the discovered effect, if there is one, in the twin as well."""
        discovery = self.diagnosis.discovery
        if discovery is None:
            return self
        definition = discovery.definition.model_copy(update={"name": name})
        renamed = discovery.model_copy(update={"definition": definition})
        *others, last = self.twin.effects
        last = last.model_copy(update={"name": name, "definition": definition})
        return DiagnosisResult(
            self.diagnosis.model_copy(update={"discovery": renamed}),
            self.twin.model_copy(update={"effects": [*others, last]}),
        )
