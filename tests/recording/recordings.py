"""Recordings of the made-up match."""

import json

from mcap.reader import NonSeekingReader

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.recording.recorder import Recorder
from vrg.testing.views import synthetic

KEYS = Keys("test")


def record(output, until, **options):
    """A recorder that has heard the made-up match until then, not yet stopped."""
    recorder = Recorder("recorder", Mailbox(), KEYS, output, **options)
    go_on(recorder, 0.0, until)
    return recorder


def go_on(recorder, begin, until):
    match = synthetic.SyntheticMatch(KEYS)
    for tick in range(round(begin * 10), round(until * 10)):
        match.step(recorder, tick / 10, tick)


def messages_of(path, **options):
    with path.open("rb") as stream:
        return list(NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False, **options))


def hear(recorder, *said):
    """Let a recorder hear messages, each (topic, message, stamp), at the latest of their stamps."""
    for number, (topic, body, stamp) in enumerate(said):
        synthetic.SyntheticMatch(KEYS).say(recorder.mailbox, topic, body, stamp, number)
    time = max(stamp for _, _, stamp in said)
    recorder.mailbox.handover(time)
    recorder.tick(Tick(time))


def written(path, topic):
    """What a recording has of a topic, each (time in s, JSON)."""
    return [(message.log_time / 1e9, json.loads(message.data)) for _, _, message in messages_of(path, topics=topic)]
