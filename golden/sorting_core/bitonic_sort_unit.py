"""gs_bitonic_sort_unit: sorts groups of SORT_N entries, by a ring or a folded bitonic network (BSU).

Lists are int64 arrays of entries, which sort as unsigned numbers below 2**ENTRY_W. Cycle functions take the sink as
always ready.
"""

from __future__ import annotations

import numba
import numpy as np

from golden import params

RING, BITONIC = 0, 1  # parameter NETWORK


def sort_groups(entries: np.ndarray, sort_n: int = params.SORT_N) -> np.ndarray:
    """[n] entries of a list, each group of sort_n ascending: what the unit sends."""
    whole = len(entries) // sort_n * sort_n
    rows = np.sort(entries[:whole].reshape(-1, sort_n), axis=1).ravel()
    return np.concatenate([rows, np.sort(entries[whole:])])


def _exchange(slots: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Puts the smaller of each pair of columns into column low, in place."""
    a, b = slots[:, low].copy(), slots[:, high]
    slots[:, low], slots[:, high] = np.minimum(a, b), np.maximum(a, b)


def ring(groups: np.ndarray) -> np.ndarray:
    """[m, n] groups through the ring's n steps: columns are cells, rotated by one each step.

    Slot p starts in cell n - 1 - p. Cells 2i and 2i + 1 are compared; the pair that holds slots n - 1 and 0 rests,
    which at step t is the pair with 2i + 1 = t.
    """
    n = groups.shape[1]
    cells = groups[:, ::-1].copy()
    for step in range(n):
        upper = np.array([c for c in range(0, n, 2) if c + 1 != step])
        _exchange(cells, upper + 1, upper)
        cells = np.roll(cells, 1, axis=1)
    return cells[:, ::-1]


def bitonic(groups: np.ndarray) -> np.ndarray:
    """[m, n] groups through the bitonic network's steps: pairs at a distance, in blocks that alternately descend."""
    slots = groups.copy()
    n = groups.shape[1]
    size = 2
    while size <= n:
        distance = size // 2
        while distance:
            low = np.array([s for s in range(n) if not s & distance])
            down = (low & size) != 0
            _exchange(slots, np.where(down, low + distance, low), np.where(down, low, low + distance))
            distance //= 2
        size *= 2
    return slots


def steps(network: int = RING, sort_n: int = params.SORT_N) -> int:
    """Cycles that sorting a full unit takes."""
    log = sort_n.bit_length() - 1
    return sort_n if network == RING else log * (log + 1) // 2


def cycles(n: int, network: int = RING, sort_n: int = params.SORT_N) -> int:
    """Cycles from the first beat taken to the end beat sent, for n entries that are always there.

    A full group fills in sort_n cycles and sorts in steps; the next fills while it leaves. Behind the last group the
    end beat follows its entries; an end beat that finds no group passes at once.
    """
    full, rest = divmod(n, sort_n)
    period = sort_n + steps(network, sort_n)
    if rest:
        return (full + 1) * period + rest + 1
    return full * period + (sort_n if full else 0) + 1


@numba.njit(cache=True)
def timing(arrival, sort_steps, sort_n=params.SORT_N):
    """When each beat is taken and sent: (taken int64[n + 1], sent int64[n + 1]) for one list into an idle unit.

    arrival: int64[n + 1], the first cycle in which each beat is offered, end beat included; beats are offered one by
    one. One turn of the loop is a cycle in which the unit fills; the steps of a sort are added in one go.
    """
    n = len(arrival) - 1
    taken = np.zeros(n + 1, np.int64)
    sent = np.zeros(n + 1, np.int64)
    i = o = pos = count = out_count = 0
    closed = out_end = False
    first_round = True
    t = arrival[0]
    while o <= n:
        emit = first_round and pos < out_count
        offered = i <= n and arrival[i] <= t and not closed
        load = offered and i < n and count == pos and (emit or not out_end)
        close = offered and i == n and count > 0
        pass_end = offered and i == n and count == 0 and not emit and not out_end
        turn = emit or (not out_end and (load or close or closed or count != pos))
        if emit or out_end or pass_end:
            sent[o] = t
            o += 1
        if load or close or pass_end:
            taken[i] = t
            i += 1
        elif not (emit or out_end or turn):
            t = max(t, arrival[i] - 1)
        if not emit:
            out_end = False
        count += load
        closed = closed or close
        if turn:
            pos += 1
        if pos == sort_n:
            pos = 0
            first_round = False
            if load or closed:
                t += sort_steps
                first_round, out_count, out_end, count, closed = True, count, closed, 0, False
        t += 1
    return taken, sent
