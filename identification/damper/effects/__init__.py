"""Library of effects, one module each, by their names in documents."""

from identification.damper.effects import connection, step_response
from identification.damper.effects.clevis_backlash import CLEVIS_BACKLASH
from identification.damper.effects.coil_crosstalk import COIL_CROSSTALK
from identification.damper.effects.coil_lag import COIL_LAG
from identification.damper.effects.connection import compute_elongation
from identification.damper.effects.direction_asymmetry import DIRECTION_ASYMMETRY
from identification.damper.effects.displacement_delay import DISPLACEMENT_DELAY
from identification.damper.effects.displacement_nonlinearity import DISPLACEMENT_NONLINEARITY
from identification.damper.effects.effect import STAGES, Action, Effect, Form, Place, Stage, Variable
from identification.damper.effects.end_stop import END_STOP
from identification.damper.effects.field_saturation import FIELD_SATURATION
from identification.damper.effects.fixture_compliance import FIXTURE_COMPLIANCE
from identification.damper.effects.force_delay import FORCE_DELAY
from identification.damper.effects.force_drift import FORCE_DRIFT
from identification.damper.effects.force_filter import FORCE_FILTER
from identification.damper.effects.former_names import rename_form, rename_parameters
from identification.damper.effects.gas_spring import GAS_SPRING
from identification.damper.effects.magnetic_remanence import MAGNETIC_REMANENCE
from identification.damper.effects.mains_hum import MAINS_HUM
from identification.damper.effects.moving_mass import MOVING_MASS
from identification.damper.effects.orifice_turbulence import ORIFICE_TURBULENCE
from identification.damper.effects.seal_friction import SEAL_FRICTION
from identification.damper.effects.shear_thinning import SHEAR_THINNING
from identification.damper.effects.side_load_friction import SIDE_LOAD_FRICTION
from identification.damper.effects.viscous_heating import VISCOUS_HEATING

_REQUIRED = (
    FIELD_SATURATION,
    MAGNETIC_REMANENCE,
    COIL_LAG,
    GAS_SPRING,
    SEAL_FRICTION,
    ORIFICE_TURBULENCE,
    DIRECTION_ASYMMETRY,
    VISCOUS_HEATING,
    END_STOP,
    CLEVIS_BACKLASH,
    FIXTURE_COMPLIANCE,
    MOVING_MASS,
    FORCE_DELAY,
    FORCE_DRIFT,
    MAINS_HUM,
    DISPLACEMENT_NONLINEARITY,
)
_ADDITIONAL = (
    FORCE_FILTER,
    DISPLACEMENT_DELAY,
    SHEAR_THINNING,
    SIDE_LOAD_FRICTION,
    COIL_CROSSTALK,
)

EFFECTS: dict[str, Effect] = {e.name: e for e in (*_REQUIRED, *_ADDITIONAL)}
"""All effects by name: first the common ones in the order of the chain, then the additional ones."""
COMMON_EFFECTS: tuple[str, ...] = tuple(e.name for e in _REQUIRED)
"""Names of the effects that any bench may show."""

__all__ = [
    "COMMON_EFFECTS",
    "EFFECTS",
    "STAGES",
    "Action",
    "Effect",
    "Form",
    "Place",
    "Stage",
    "Variable",
    "compute_elongation",
    "connection",
    "rename_form",
    "rename_parameters",
    "step_response",
]
