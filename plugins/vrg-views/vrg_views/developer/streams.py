"""The streams of messages, and which of them are bad."""

from collections.abc import Sequence
from typing import Final

from vrg.bus.topics import Keys, Qos, key_matches
from vrg_views.developer import words
from vrg_views.developer.insight import Insight
from vrg_views.developer.tables import Cell, Grid, GridRow, Tone
from vrg_views.developer.traffic import Stream

SILENCE: Final = 1.0
"""The real time in s after which a stream that was regular counts as silent."""
SILENCE_FACTOR: Final = 5.0
"""A stream counts as silent after so many times the longest time that there was between two of its messages."""
SHARED: Final = tuple(
    line.path for line in (Keys.official, Keys.estop, Keys.estop_release, Keys.seat_request, Keys.seat_answer)
)
"""The keys on which several may speak, so that the numbers of their messages do not tell what was lost."""
SHARED_BY_NAME: Final = tuple(Keys.expression(line.path) for line in (Keys.camera_request, Keys.manual))
"""The same, of keys with names in them."""
EVENTS: Final = tuple(Keys.expression(line.path) for line in Keys.lines() if line.qos is Qos.EVENT)
"""The keys whose messages come when something happens, so that silence there is nothing bad."""
STREAM_COLUMNS: Final = ("key", "from", "Hz", "kB/s", "age", "lost")


def health(stream: Stream) -> Tone:
    """The tone of a stream: alarm if it has lost messages lately, caution if it has lost some or fallen silent."""
    if stream.bad or stream.misrouted or (stream.lately and not has_several_senders(stream.key)):
        return Tone.ALARM
    events = any(key_matches(expression, stream.key) for expression in EVENTS)
    regular = 0.0 < stream.longest < SILENCE and not events
    if (stream.lost and not has_several_senders(stream.key)) or (
        regular and stream.age > max(SILENCE, SILENCE_FACTOR * stream.longest)
    ):
        return Tone.CAUTION
    return Tone.PLAIN


def has_several_senders(key: str) -> bool:
    """True if several may speak on a key, so that the numbers of its messages do not tell what was lost."""
    return key in SHARED or any(key_matches(expression, key) for expression in SHARED_BY_NAME)


def streams(insight: Insight) -> Grid:
    """A row for each stream, the bad ones first."""
    grave = {Tone.ALARM: 0, Tone.CAUTION: 1}
    tones = {stream.key: health(stream) for stream in insight.streams}
    ordered = sorted(insight.streams, key=lambda stream: (grave.get(tones[stream.key], 2), stream.key))
    notes = [totals(insight.streams), most(insight.streams)] if ordered else [words.NOTHING_HEARD]
    notes += [words.NOT_HEARD.format(", ".join(insight.unheard))] if insight.unheard else []
    return Grid([_stream(stream, tones[stream.key]) for stream in ordered], STREAM_COLUMNS, "\n".join(notes))


def _stream(stream: Stream, tone: Tone) -> GridRow:
    lost = words.UNKNOWN if has_several_senders(stream.key) else str(stream.lost)
    return GridRow(
        "",
        (
            Cell(stream.key, tone),
            Cell(stream.sender, Tone.QUIET),
            Cell(f"{stream.rate:.1f}", tone),
            Cell(f"{stream.bandwidth / 1e3:.1f}", tone),
            Cell(f"{stream.age:.1f}", tone),
            Cell(" ".join([lost, *_refused(stream)]), tone),
        ),
    )


def totals(heard: Sequence[Stream]) -> str:
    """All streams together, in words."""
    return words.SUMMARY.format(
        count=len(heard),
        rate=sum(stream.rate for stream in heard),
        bandwidth=sum(stream.bandwidth for stream in heard) / 1e3,
        lost=sum(stream.lost for stream in heard if not has_several_senders(stream.key)),
    )


def most(heard: Sequence[Stream]) -> str:
    """Those who publish most, in words."""
    sums: dict[str, float] = {}
    for stream in heard:
        sums[stream.sender] = sums.get(stream.sender, 0.0) + stream.bandwidth / 1e3
    first = sorted(sums.items(), key=lambda each: -each[1])[:3]
    return words.MOST.format(", ".join(f"{sender} {bandwidth:.1f}" for sender, bandwidth in first))


def _refused(stream: Stream) -> list[str]:
    """The numbers of refused messages of a key, in words."""
    counts = {"bad": stream.bad, "misrouted": stream.misrouted}
    return [f"+{count} {what}" for what, count in counts.items() if count]
