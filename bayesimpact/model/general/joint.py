"""The mass and the bodies that ring with it, where no further force acts: one exact linear flow.

State (y, y', x, x' of the obstacle's body, x, x' of the frame's), counted from where all of it
would rest. The matrix of the usual step is kept, one in flight and one in contact; steps of other
lengths, which end on an event, are summed as power series.
"""

from __future__ import annotations

import math
from typing import Any

from bayesimpact.model.general.contact_state import JOINT
from bayesimpact.model.general.context import AHEAD, NOW, WORK_COLUMNS
from bayesimpact.model.general.resonator import FRAME, OBSTACLE, acts, body, row
from bayesimpact.model.jit.compiled import compiled, inner

TERMS = 16  # over at most half a radian: the rest is below 1e-17
SIZE = 6
KEPT = 3 + SIZE * SIZE  # h, b, K and the matrix
FASTEST = 1e4  # rad in a step: the series is summed twice as often per step
SAME = 1e-11  # relative difference up to which a step has the usual length


@compiled()
def series(
    state: tuple[float, float, float, float, float, float], h: float,
    b: float, K: float, ao: float, Wo: float, do: float, af: float, Wf: float, df: float,
    held: float,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """The state after a time h under

        y'' = -2 b y' - K y + ao (Wo x + do x') + af (Wf z + df z')
        x'' = -Wo x - do x' + held (Wo y + do y')       z'' = -Wf z - df z' + Wf y + df y'

    with held = 1 while the obstacle's body follows the mass, else 0; ao, af its mass over that
    which moves, 0 where there is none or it does not act. NaN for a body that is far too fast to be
    followed.
    """
    y, v, x, r, z, s = state
    rate = math.sqrt(K) + 2.0 * b + math.sqrt(Wo) + do + math.sqrt(Wf) + df
    if not rate * h < FASTEST:
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    pieces = max(1, math.ceil(2.0 * rate * h))
    h /= pieces
    for _ in range(pieces):
        yn, vn, xn, rn, zn, sn = y, v, x, r, z, s
        for n in range(TERMS):
            step = h / (n + 1.0)
            pull, turn = Wo * xn + do * rn, Wf * zn + df * sn
            yn, vn, xn, rn, zn, sn = (
                step * vn,
                step * (ao * pull + af * turn - 2.0 * b * vn - K * yn),
                step * rn,
                step * (held * (Wo * yn + do * vn) - pull),
                step * sn,
                step * (Wf * yn + df * vn - turn),
            )
            y, v, x, r, z, s = y + yn, v + vn, x + xn, r + rn, z + zn, s + sn
    return y, v, x, r, z, s


@inner()
def joint_step(y: Any, v: Any, h: Any, flow: Any, w: Any) -> Any:
    """Displacement and velocity a time h on; the bodies' states then stand in AHEAD."""
    touching = flow.touching == 1.0
    mo, Wo, do = body(OBSTACLE, w)
    mf, Wf, df = body(FRAME, w)
    held = 1.0 if acts(OBSTACLE, touching, w) else 0.0
    ao, af = held * flow.inverse * mo, flow.inverse * mf
    if mo == 0.0:
        Wo = do = 0.0
    if mf == 0.0:
        Wf = df = 0.0
    level = ao * Wo * flow.gap if held > 0.0 else 0.0  # without a stop the gap is infinite
    rest = (flow.K * flow.rest - level) / (flow.K - ao * Wo - af * Wf)
    inside = rest - flow.gap if held > 0.0 else 0.0
    at, frame = row(OBSTACLE, w), row(FRAME, w)
    state = (
        y - rest, v, w.work[at + NOW] - inside, w.work[at + WORK_COLUMNS + NOW],
        w.work[frame + NOW] - rest, w.work[frame + WORK_COLUMNS + NOW],
    )  # fmt: skip
    if abs(h - flow.hop) <= SAME * h:
        kept = JOINT + (KEPT if touching else 0)
        if w.s[kept] != flow.hop or w.s[kept + 1] != flow.b or w.s[kept + 2] != flow.K:
            w.s[kept], w.s[kept + 1], w.s[kept + 2] = flow.hop, flow.b, flow.K
            keep(kept + 3, flow.hop, flow.b, flow.K, ao, Wo, do, af, Wf, df, held, w)
        state = hop(kept + 3, state, w)
    else:
        state = series(state, h, flow.b, flow.K, ao, Wo, do, af, Wf, df, held)
    w.work[at + AHEAD], w.work[at + WORK_COLUMNS + AHEAD] = state[2] + inside, state[3]
    w.work[frame + AHEAD], w.work[frame + WORK_COLUMNS + AHEAD] = state[4] + rest, state[5]
    return state[0] + rest, state[1]


@inner()
def keep(
    first: Any, h: Any, b: Any, K: Any, ao: Any, Wo: Any, do: Any, af: Any, Wf: Any, df: Any,
    held: Any, w: Any,
) -> Any:  # fmt: skip
    """Write the matrix of a step, column by column."""
    for column in range(SIZE):
        unit = (
            1.0 if column == 0 else 0.0, 1.0 if column == 1 else 0.0,
            1.0 if column == 2 else 0.0, 1.0 if column == 3 else 0.0,
            1.0 if column == 4 else 0.0, 1.0 if column == 5 else 0.0,
        )  # fmt: skip
        y, v, x, r, z, s = series(unit, h, b, K, ao, Wo, do, af, Wf, df, held)
        at = first + SIZE * column
        w.s[at], w.s[at + 1], w.s[at + 2] = y, v, x
        w.s[at + 3], w.s[at + 4], w.s[at + 5] = r, z, s


@inner()
def hop(first: Any, state: Any, w: Any) -> Any:
    """The state after the step whose matrix is kept."""
    y = v = x = r = z = s = 0.0
    for column in range(SIZE):
        by, at = state[column], first + SIZE * column
        y, v, x = y + by * w.s[at], v + by * w.s[at + 1], x + by * w.s[at + 2]
        r, z, s = r + by * w.s[at + 3], z + by * w.s[at + 4], s + by * w.s[at + 5]
    return y, v, x, r, z, s
