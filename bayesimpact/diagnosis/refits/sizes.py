"""The sizes of a model's effects, and what the model would lose without one, to first order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.parameters import bare_name


def sizes_of(fit: Fit, effect: Effect) -> tuple[list[tuple[int, float]], list[int]]:
    """Positions of an effect's sizes with their null, and of its shapes, in a fit's mode.

    No sizes where it has none, or one without a null.
    """
    names = fit.density.oscillator.layout.names
    own = [i for i, name in enumerate(names) if name.startswith(f"{effect.id}.")]
    kinds = [(i, effect.parameter(bare_name(names[i]))) for i in own]
    shapes = [i for i, kind in kinds if kind.is_shape]
    sizes = [(i, kind.null) for i, kind in kinds if kind.is_size]
    known = [(i, null) for i, null in sizes if null is not None]
    return (known if len(known) == len(sizes) else []), shapes


def named_size_of(fit: Fit, effect: Effect) -> list[tuple[int, float]]:
    """The same of the size that an effect is called by, the first that it has: all its instances.

    A damper beside a second spring is no second spring.
    """
    sizes, _ = sizes_of(fit, effect)
    names = [bare_name(fit.names[i]) for i, _ in sizes]
    return [size for size, name in zip(sizes, names, strict=True) if name == names[0]]


def shapes_in_base(fit: Fit, effect: Effect) -> list[tuple[int, float]]:
    """Positions of an effect's shapes in a fit's mode that have a value at which the law is one of
    the base model's, with that value.
    """
    limits = [(p.name, p.in_base) for p in effect.parameters if p.in_base is not None]
    return _positions(fit, effect, limits)


def shapes_until(fit: Fit, effect: Effect) -> list[tuple[int, float]]:
    """The same of shapes that have a value from which on the law is not what it is called."""
    limits = [(p.name, p.until) for p in effect.parameters if p.until is not None]
    return _positions(fit, effect, limits)


def _positions(
    fit: Fit, effect: Effect, limits: Sequence[tuple[str, float]]
) -> list[tuple[int, float]]:
    """Positions of an effect's named parameters in a fit's mode, each with its value."""
    names = fit.density.oscillator.layout.names
    return [
        (i, value)
        for own, value in limits
        for i, name in enumerate(names)
        if name.startswith(f"{effect.id}.") and bare_name(name) == own
    ]


def loss_without(fit: Fit, effect: Effect) -> float:
    """Log likelihood that a fit loses without an effect as far as it is linear, nats; 0 for one
    without a size.

    The residual's sum of squares grows by the square of the sizes from their null, over their
    covariance (Wald 1943, Trans. Am. Math. Soc. 54:426), and the noise level with it.
    """
    sizes, _ = sizes_of(fit, effect)
    if not sizes:
        return 0.0
    at = [i for i, _ in sizes]
    away = np.array([fit.mode[i] - null for i, null in sizes])
    sd = fit.sd[at]
    if not np.all(sd > 0.0):
        return 0.0
    scaled = fit.covariance[np.ix_(at, at)] / np.outer(sd, sd)
    grown = float((away / sd) @ np.linalg.lstsq(scaled, away / sd, rcond=1e-12)[0])
    total = float(fit.density.likelihood.sizes.sum())
    return 0.5 * total * float(np.log1p(max(grown, 0.0) / total))
