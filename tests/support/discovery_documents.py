"""Documents of a diagnosis that found a gain over the displacement outside the library."""

from identification.damper.definitions import Curve, EffectFile, EffectParameter
from identification.documents import DiscoveredCurve, Discovery, EffectValue, Formula, Twin, TwinEffect
from identification.documents.diagnosis import Diagnosis
from identification.gap.outcome import DiagnosisResult
from tests.support.gaps import GAP

CURVE = Curve(variable="displacement", unit="1", x=[-0.01, 0.01], value=[0.1, 0.3], lo=[0.0, 0.2], hi=[0.2, 0.4])
DEFINITION = EffectFile(
    name="discovered_effect",
    stage="damper",
    place="damper_gain",
    variables=["displacement"],
    expression="a*displacement**2",
    parameters={"a": EffectParameter(value=2e3, unit="1/m^2", lo=-1e5, hi=1e5)},
)
FURTHER = DiscoveredCurve(
    stage="mounting", place="mounting", variables=["acceleration"], rmse_n=2.6, log_odds=8.0,
    curve=CURVE.model_copy(update={"variable": "acceleration"}),
)  # fmt: skip


def make_discovery(**changes) -> Discovery:
    """Return the document of a gain with a formula; without one for ``formula=None``."""
    symbols = {"a": EffectValue(value=2e3, unit="1/m^2", ci95=(1.9e3, 2.1e3))}
    fields = {
        "stage": "damper", "place": "damper_gain", "variables": ["displacement"], "curve": CURVE, "rmse_n": 2.75,
        "log_odds": 40.0, "formula": Formula(expression="a*displacement**2", symbols=symbols),
        "definition": DEFINITION, "shrinkage": 0.97, "shrinkage_ci95": (0.95, 0.99), "further": [FURTHER],
    }  # fmt: skip
    return Discovery(**fields | changes)


def make_result(discovery: Discovery | None = None) -> DiagnosisResult:
    """Return a diagnosis that explains nothing, with the fields that a command and a new name need."""
    diagnosis = Diagnosis.model_construct(
        verdict="unexplained", effects=[], gap=GAP, cross_check=None, discovery=discovery, notes=["a note"]
    )
    effects = [TwinEffect(name="gas_spring", form="polytropic", parameters={"force": 90.0, "length": 0.05})]
    if discovery is not None:
        effects.append(
            TwinEffect(name="discovered_effect", form="defined", parameters={"a": 2e3}, definition=DEFINITION)
        )
    return DiagnosisResult(diagnosis, Twin.model_construct(effects=effects, description="twin"))
