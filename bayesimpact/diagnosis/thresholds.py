"""Every threshold of the verdicts, with where it comes from. Thresholds of the search and of the
score tests, which only decide what is tried, stand where they are used.
"""

from __future__ import annotations

import math

ALPHA = 0.004
"""Of the tests of a free force against the noise, which stand beside its odds: what a thousand
draws of the null resolve well.
"""

DECISIVE = 5.5
"""Nats of log odds that a name needs over every rival: 2 ln odds of 11, the "very strong" evidence
of Kass and Raftery (1995) with the margin that methods.md measured over near neighbours: none of 26
names wrong.
"""

LARGE = 3.0
"""Residual over noise from which on a misfit is large: problems linearised about such a fit rank
what could be added, but their sizes and odds are not believed.
"""

EXCESS = 4.0
"""How many times as much must be left without an effect as with it, where something remains; and
how many times less a free force must leave to replace all effects. An effect that only imitates
physics outside the catalogue, with responses at a cosine of 0.87 or less, leaves more than a
quarter. Models that leave less than that many times as much do not stand out either: intervals hold
their values too. Not calibrated on trials yet.
"""

APART = 2.576
"""Standard deviations of an effect's size from none at all, where something remains: its two-sided
99 % interval holds no such effect, and so does no reported one.
"""

DOUBT = 3.0
"""Standard errors of the noise level: a misfit below is within what the level is uncertain by."""


def largest_log_odds(p_value: float) -> float:
    """Largest log odds against the null that a p-value can stand for, nats: 1 / (-e p ln p).

    Sellke, Bayarri and Berger 2001, Am. Stat. 55:62, Eq. 3; 0 from p = 1/e on.
    """
    if p_value >= math.exp(-1.0):
        return 0.0
    p = max(p_value, 1e-300)
    return -math.log(-math.e * p * math.log(p))
