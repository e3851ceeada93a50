"""gs_hit_queue: the hits of one SCU, list by list, each list with a mark behind it."""

from __future__ import annotations

from collections.abc import Iterable

MARK_DELAY = 2  # cycles from a list's close to the first one in which its mark is shown


def lists(beats: Iterable[tuple[int | None, tuple[int, int] | None]]) -> list[tuple[int, int, list[int]]]:
    """(void, end, slots) of each list. A beat: the slot that is pushed or None, (void, end) of a close or None."""
    found = []
    slots: list[int] = []
    for slot, close in beats:
        if slot is not None:
            slots.append(slot)
        if close is not None:
            found.append((*close, slots))
            slots = []
    return found
