"""Recordings of the made-up match."""

from mcap.reader import NonSeekingReader

from tests.ui import synthetic
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.recording.recorder import Recorder

KEYS = Keys("test")


def record(output, until, **options):
    """A recorder that has heard the made-up match until then, not yet stopped."""
    recorder = Recorder("recorder", Mailbox(), KEYS, output, **options)
    go_on(recorder, 0.0, until)
    return recorder


def go_on(recorder, begin, until):
    match = synthetic.Match(KEYS)
    for tick in range(round(begin * 10), round(until * 10)):
        match.step(recorder, tick / 10, tick)


def messages_of(path, **options):
    with path.open("rb") as stream:
        return list(NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False, **options))
