"""Two fifth-order methods with Boole's weights, carried along by an exact linear flow.

A force at one node acts on the later ones through the flow's impulse response (Lawson 1967, SIAM J.
Numer. Anal. 4:372); all nodes are quarters of the step, so four responses serve for everything.
`stage` is Butcher's Runge-Kutta method with nodes 0, 1/4, 1/4, 1/2, 3/4, 1 (Butcher 1964, J.
Austral. Math. Soc. 4:179). Where no force depends on the velocity, one at each quarter is enough:
`place_stage` is a Nystroem method, its coefficients the solution of the conditions of order five
(Hairer, Norsett and Wanner 1993, Solving Ordinary Differential Equations I, section II.14).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from bayesimpact.model.exact.flow import impulse_response
from bayesimpact.model.jit.compiled import compiled


class Quarters(NamedTuple):
    """The linear flow after one to four quarters of a step of length h.

    S and D = S' are its impulse response; a force of 1 N at one stage of the step adds, before the
    method's weights, F_k to the displacement and G_k to the velocity k quarters later.
    """

    h: Any
    S1: Any
    D1: Any
    S2: Any
    D2: Any
    S3: Any
    D3: Any
    S4: Any
    D4: Any
    F1: Any
    F2: Any
    F3: Any
    F4: Any
    G0: Any
    G1: Any
    G2: Any
    G3: Any
    G4: Any


@compiled(forceinline=True)
def quarters(h: Any, b: Any, K: Any, inverse: Any) -> Any:
    """`Quarters` of a step of length h, by the addition theorem; `inverse` is 1 / mass."""
    S1, D1 = impulse_response(b, K, 0.25 * h)
    K_S1, first = K * S1, D1 + 2.0 * b * S1
    S2, D2 = S1 * (D1 + first), D1 * D1 - K_S1 * S1
    S3, D3 = S2 * first + D2 * S1, D2 * D1 - K_S1 * S2
    S4, D4 = 2.0 * S2 * (D2 + b * S2), D2 * D2 - K * S2 * S2
    c = h * inverse
    return Quarters(
        h, S1, D1, S2, D2, S3, D3, S4, D4,
        c * S1, c * S2, c * S3, c * S4, c, c * D1, c * D2, c * D3, c * D4,
    )  # fmt: skip


@compiled(forceinline=True, fastmath={"contract"})
def stage(
    number: Any, base: Any, c0: Any, c1: Any, c2: Any, c3: Any, c4: Any,
    n0: Any, n1: Any, n2: Any, n3: Any, n4: Any, n5: Any,
) -> Any:  # fmt: skip
    """Value at a stage: `base` without, plus what n0, n1, ... at the earlier stages have added.

    c_k is the response k quarters of a step later. Stages 1 to 5 lie at 1, 1, 2, 3 and 4 quarters;
    stage 6 is the end of the step. The newest n comes last, for it is what has to be waited for.
    """
    if number == 1:
        return base + 0.25 * c1 * n0
    if number == 2:
        return base + 0.125 * c1 * n0 + 0.125 * c0 * n1
    if number == 3:
        return base - 0.5 * c1 * n1 + c1 * n2
    if number == 4:
        return base + 0.1875 * c3 * n0 + 0.5625 * c1 * n3
    if number == 5:
        early = base - 3.0 / 7.0 * c4 * n0 + 2.0 / 7.0 * c3 * n1 + 12.0 / 7.0 * c3 * n2
        return early - 12.0 / 7.0 * c2 * n3 + 8.0 / 7.0 * c1 * n4
    early = base + 7.0 / 90.0 * c4 * n0 + 32.0 / 90.0 * c3 * n2 + 12.0 / 90.0 * c2 * n3
    return early + 32.0 / 90.0 * c1 * n4 + 7.0 / 90.0 * c0 * n5


@compiled(forceinline=True, fastmath={"contract"})
def place_stage(
    number: Any, base: Any, c0: Any, c1: Any, c2: Any, c3: Any, c4: Any,
    n0: Any, n1: Any, n2: Any, n3: Any, n4: Any,
) -> Any:  # fmt: skip
    """`stage` for forces of place and time alone: stages 1 to 4 lie at 1 to 4 quarters.

    Stage 4 is the end of the step; its displacement does not depend on n4, for c0 is zero there.
    """
    if number == 1:
        return base + 1.0 / 8.0 * c1 * n0
    if number == 2:
        return base - 1.0 / 36.0 * c2 * n0 + 5.0 / 9.0 * c1 * n1
    if number == 3:
        return base + 5.0 / 48.0 * c3 * n0 + 13.0 / 48.0 * c2 * n1 + 13.0 / 48.0 * c1 * n2
    early = base + 7.0 / 90.0 * c4 * n0 + 32.0 / 90.0 * c3 * n1 + 12.0 / 90.0 * c2 * n2
    return early + 32.0 / 90.0 * c1 * n3 + 7.0 / 90.0 * c0 * n4
