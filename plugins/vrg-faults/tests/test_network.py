"""Simulated lines: what comes late, what is lost, and what a link that is back makes up for."""

from dataclasses import dataclass, field

import pytest

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.hal.simulated_clock import SimulatedClock
from vrg.types import Pose
from vrg_faults.machine import Machine
from vrg_faults.network import LATENCY, Network
from vrg_faults.plan import Streams
from vrg_faults.session import LEASE, SimulatedSession

KEYS = Keys("m")


def call(number: int) -> m.Call:
    return m.Call(number=number, rule="r", text="", players=("a",), poses=(Pose(1.0, 2.0, 0.5),), clock=0.5)


@dataclass
class Table:
    """A referee that calls, and a listener; both have heard of one another by call 0."""

    clock: SimulatedClock = field(default_factory=SimulatedClock)
    heard: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.network = Network(self.clock, Streams(1))
        self.sender, self.receiver = Mailbox("coordinator/referee"), Mailbox("player/ann")
        self.inlet = self.receiver.subscribe(KEYS.referee_event)
        self.alarms = self.receiver.subscribe(KEYS.estop, alarm=lambda _: self.sounded.append(self.clock.now()))
        self.sounded: list[float] = []
        self.referee, self.player = self.session("referee"), self.session("ann")
        self.player.attach(self.receiver)
        self.call(0)
        self.clock.sleep(2.0 * LATENCY[1])
        assert self.received() == [0]

    def session(self, name: str) -> SimulatedSession:
        return SimulatedSession(self.network, Machine(self.clock, Streams(1)(name)), name, 1)

    def call(self, number: int) -> None:
        self.sender.publish(KEYS.referee_event, call(number))
        self.referee.send(self.sender.collect())

    def received(self) -> list[int]:
        self.player.receive()
        self.receiver.handover(0.0)
        self.heard += [received.body.number for received in self.inlet.take()]
        return self.heard


@pytest.mark.parametrize("name", ["referee", "ann"])
@pytest.mark.parametrize("length", [0.5 * LEASE, 2.0 * LEASE])
@pytest.mark.parametrize("noticed", [False, True])
def test_calls_made_while_a_line_is_cut_all_come_later_in_their_order(name: str, length: float, noticed: bool) -> None:
    table = Table()
    table.network.line(name).break_off(noticed=noticed)
    for number in (1, 2):
        table.call(number)
        table.clock.sleep(length / 2)
    assert table.received() == [0]
    table.network.line(name).mend()
    table.call(3)
    table.clock.sleep(0.5)
    assert table.received() == [0, 1, 2, 3]


def test_a_cut_is_noticed_when_the_lease_is_over() -> None:
    table = Table()
    table.network.line("ann").break_off(noticed=False)
    table.clock.sleep(0.9 * LEASE)
    assert table.player.connected
    table.clock.sleep(0.2 * LEASE)
    assert not table.player.connected


def test_an_alarm_of_a_frozen_process_sounds_when_it_thaws() -> None:
    table = Table()
    table.player.freeze(True)
    table.sender.publish(KEYS.estop, m.Estop(by="ann"))
    table.referee.send(table.sender.collect())
    table.clock.sleep(0.5)
    assert not table.sounded
    table.player.freeze(False)
    assert len(table.sounded) == 1


def test_a_process_that_is_started_again_has_the_line_of_the_one_before() -> None:
    table = Table()
    table.network.line("ann").loss = 0.5
    table.player.close()
    assert table.session("ann").line.loss == 0.5


def test_what_is_on_its_way_to_a_process_that_ends_is_lost() -> None:
    table = Table()
    table.call(1)
    table.player.close()
    table.clock.sleep(1.0)
    assert table.received() == [0]
