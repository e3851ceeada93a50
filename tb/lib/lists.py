"""Lists of beats, each ending with one whose `last` is set, sent one at a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tb.lib.stream import Sink, Source


async def send_apart(source: Source, sink: Sink, beats: Iterable[Sequence], answers: Iterable[int]) -> None:
    """Send a list, up to its beat with `last`, when the sink has its answers (so many beats) to all lists before it."""
    rest = iter(beats)
    wanted = 0
    for n in answers:
        for beat in rest:
            source.send([beat])
            if beat[-1]:
                break
        wanted += n
        await sink.wait(wanted)
