"""The effects that the product knows, one file each, by their names in documents."""

from identification.damper.effects.clevis_backlash import CLEVIS_BACKLASH
from identification.damper.effects.effect import Effect
from identification.damper.effects.force_delay import FORCE_DELAY
from identification.damper.effects.gas_spring import GAS_SPRING
from identification.damper.effects.seal_friction import SEAL_FRICTION

EFFECTS: dict[str, Effect] = {e.name: e for e in (GAS_SPRING, SEAL_FRICTION, CLEVIS_BACKLASH, FORCE_DELAY)}

__all__ = ["EFFECTS", "Effect"]
