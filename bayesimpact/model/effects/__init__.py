"""The catalogue: one effect, one file; `EFFECTS` is the only registration."""

from bayesimpact.model.effects import contact_relaxation, quadratic_drag
from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Scales, address

EFFECTS: tuple[Effect, ...] = (
    contact_relaxation.EFFECT,
    quadratic_drag.EFFECT,
)

__all__ = ["EFFECTS", "Effect", "EffectParameter", "Law", "Scales", "address"]
