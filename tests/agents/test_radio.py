"""What players say to their team, over links that can be modelled."""

from vrg.agents.radio import Radio, RadioLink, TeamMessage, Transmission, packed
from vrg.bus.codec import Received, decode, encode
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Say
from vrg.bus.topics import Keys

KEYS = Keys("m")


class Lossy:
    """Loses every message of an odd number, and delays the others by distance; a function of the message alone."""

    def __init__(self) -> None:
        self.asked: list[Transmission] = []

    def delay(self, message: Transmission) -> float | None:
        self.asked.append(message)
        if message.sequence % 2:
            return None
        return 0.1 * (message.distance or 0.0)


class Station:
    """A radio whose air is the test."""

    def __init__(self, name: str, link: RadioLink | None = None) -> None:
        self.mailbox = Mailbox()
        self.radio = Radio(KEYS, self.mailbox, name, "red", link)

    def say(self, words: object, now: float) -> list[Received[Say]]:
        self.mailbox.handover(now)
        self.radio.say(packed(words), (0.0, 0.0))
        return [decode(encode(out.message), Say, out.message.key) for out in self.mailbox.collect()]

    def hear(self, messages: list[Received[Say]], now: float) -> list[TeamMessage]:
        for message in messages:
            for inlet in self.mailbox.inlets:
                inlet.offer(message)
        self.mailbox.handover(now)
        return list(self.radio.heard((3.0, 4.0)))


def test_what_is_said_reaches_the_others_of_the_team() -> None:
    said = Station("ann").say({"at": (1, 2), "who": "shark"}, 1.0)
    assert [message.key for message in said] == ["vrg/m/team/red/say/ann"]
    assert Station("bob").hear(said, 1.1) == [TeamMessage("ann", 1.0, {"at": [1, 2], "who": "shark"})]


def test_a_link_loses_and_delays_by_the_message_alone() -> None:
    ann, link = Station("ann"), Lossy()
    bob = Station("bob", link)
    said = [message for number in range(4) for message in ann.say(number, 1.0)]
    assert bob.hear(said, 1.1) == []
    assert bob.hear([], 1.4) == []
    assert [heard.words for heard in bob.hear([], 1.5)] == [0, 2], "half a second for five metres"
    assert {asked.distance for asked in link.asked} == {5.0}
    assert {(asked.speaker, asked.listener) for asked in link.asked} == {("ann", "bob")}


def test_the_order_of_arrival_changes_nothing() -> None:
    ann = Station("ann")
    said = [message for number in range(6) for message in ann.say(number, 1.0 + number / 10)]
    there, back = Station("bob", Lossy()), Station("bob", Lossy())
    assert there.hear(said, 5.0) == back.hear(said[::-1], 5.0)


def test_bytes_that_are_no_words_harm_nobody() -> None:
    broken = Received(KEYS.say("red", "ann").key, 1.0, 0, Say(words=b"\xc1\xff"))
    assert Station("bob").hear([broken], 1.1) == [TeamMessage("ann", 1.0, b"\xc1\xff")]
