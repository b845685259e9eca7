"""The general simulator's table of laws: a row for every law, its columns and its flags."""

from __future__ import annotations

from bayesimpact.model.effects.effect import Law, address

LAW_FORCE, LAW_RATE, LAW_SURFACE, LAW_FLAGS = range(4)
LAW_FIRST, LAW_TIME_RATE, LAW_FEATURE, LAW_TURN, LAW_TRAVEL, LAW_INITIAL, LAW_COLUMNS = range(4, 11)
CONTACT_ONLY, KINK_AT_TURN, ROUGH_AT_TOUCH, POLYNOMIAL, PLACED = 1, 2, 4, 8, 16
JUMP_AT_TURN, JUMP_AT_SURFACE = 32, 64


def law_row(law: Law, first: int, initial: int = -1) -> list[int]:
    """A law's row in the general simulator's table.

    Parameters
    ----------
    first : slot at which the law's parameters begin
    initial : slot of its state at the first sample; -1: that is 0
    """
    stated = (
        (law.where == "contact", CONTACT_ONLY),
        (law.kink_at_turn, KINK_AT_TURN),
        (law.rough_at_touch, ROUGH_AT_TOUCH),
        (law.polynomial, POLYNOMIAL),
        (law.ignores_speed, PLACED),
        (law.jump_at_turn, JUMP_AT_TURN),
        (law.jump_at_surface, JUMP_AT_SURFACE),
    )
    functions = {
        LAW_FORCE: law.force,
        LAW_RATE: law.rate,
        LAW_SURFACE: law.surface,
        LAW_TIME_RATE: law.time_rate,
        LAW_FEATURE: law.feature_length,
        LAW_TURN: law.first_at_turn,
        LAW_TRAVEL: law.travel,
    }
    row = [0] * LAW_COLUMNS
    row[LAW_FLAGS] = sum(flag for holds, flag in stated if holds)
    row[LAW_FIRST], row[LAW_INITIAL] = first, initial
    for column, function in functions.items():
        row[column] = address(function) if function else 0
    return row
