"""The order in which the in-process executor calls and delivers."""

import numpy as np
import pytest
from msgspec import structs

from tests.bus.bench import KEYS
from vrg.bus import messages as m
from vrg.bus.lockstep import Lockstep
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick, due_index
from vrg.types import STILL, Twist


class _World(Node):
    kind = "world"

    def __init__(self, trace: list[str]) -> None:
        super().__init__("world", Mailbox(), 0.02)
        self.drives = self.mailbox.subscribe(KEYS.drive())
        self.trace = trace
        self.ticks = 0

    def tick(self, tick: Tick) -> None:
        heard = [f"{d.key.split('/')[3]}@{d.stamp:.2f}" for d in self.drives.take()]
        self.trace.append(f"world {tick.time:.2f} hears {heard}")
        clock = m.Clock(time=tick.time, tick=self.ticks, epoch=0, rate=0.0, estop=False)
        self.mailbox.publish(KEYS.clock, clock)
        self.ticks += 1


class _Driver(Node):
    kind = "player"

    def __init__(self, name: str, trace: list[str], period: float = 0.04) -> None:
        super().__init__(name, Mailbox(), period)
        self.clock = self.mailbox.subscribe(KEYS.clock)
        self.others = self.mailbox.subscribe(KEYS.drive())
        self.trace = trace

    def tick(self, tick: Tick) -> None:
        assert self.clock.latest is not None
        heard = sorted(o.key.split("/")[3] for o in self.others.take())
        self.trace.append(f"{self.name} {tick.time:.2f} clock {self.clock.latest.stamp:.2f} hears {heard}")
        self.mailbox.publish(KEYS.drive(self.name), m.Drive(twist=Twist(0.0, 0.0)))

    def stop(self) -> None:
        self.mailbox.publish(KEYS.drive(self.name), m.Drive(twist=STILL, armed=False))


def traced(
    *names: str, ticks: int, kind: type[_Driver] = _Driver, strict: bool = False, halves: bool = False
) -> list[str]:
    """What a world and these drivers do in so many ticks."""
    trace: list[str] = []
    executor = Lockstep(_World(trace), [kind(name, trace) for name in names], strict=strict)
    for _ in range(ticks):
        if halves:
            executor.begin()
            executor.finish()
        else:
            executor.step()
    return trace


def test_the_world_speaks_first_and_players_hear_each_other_one_tick_later() -> None:
    assert traced("b", "a", ticks=3) == [
        "world 0.00 hears []",
        "a 0.00 clock 0.00 hears []",
        "b 0.00 clock 0.00 hears []",
        "world 0.02 hears ['a@0.00', 'b@0.00']",
        "world 0.04 hears []",
        "a 0.04 clock 0.04 hears ['a', 'b']",
        "b 0.04 clock 0.04 hears ['a', 'b']",
    ]


def test_at_the_end_the_world_hears_that_robots_were_let_go() -> None:
    trace: list[str] = []
    executor = Lockstep(_World(trace), [_Driver("a", trace)])
    executor.step()
    executor.step()
    executor.stop()
    assert trace[-1] == "world 0.04 hears ['a@0.00']"


class _Asked(_Driver):
    """Tells when it begins, so that somebody can come between that and its tick."""

    def begin(self, tick: Tick) -> None:
        assert self.clock.latest is not None
        self.trace.append(f"{self.name} {tick.time:.2f} begins, clock {self.clock.latest.stamp:.2f}")


def test_neither_the_order_of_the_list_nor_halves_nor_strictness_change_anything() -> None:
    assert traced(*"abc", ticks=10) == traced(*"cab", ticks=10) == traced(*"bca", ticks=10, strict=True)
    assert traced(*"ab", ticks=5, kind=_Asked) == traced(*"ab", ticks=5, kind=_Asked, halves=True)


def test_who_comes_between_the_halves_finds_what_the_nodes_have_heard_and_the_halves_take_turns() -> None:
    trace: list[str] = []
    executor = Lockstep(_World(trace), [_Asked("a", trace)])
    with pytest.raises(RuntimeError, match="call begin"):
        executor.finish()
    executor.begin()
    assert trace == ["world 0.00 hears []", "a 0.00 begins, clock 0.00"]
    assert executor.time == 0.0
    with pytest.raises(RuntimeError, match="call finish"):
        executor.begin()
    executor.finish()
    assert executor.time == pytest.approx(0.02)


def test_a_node_is_due_once_in_each_of_its_periods_however_time_is_cut_and_rounding_makes_none_late() -> None:
    for step in (0.02, 0.01, 0.005):
        due = [due_index(i * step, 0.1) for i in range(round(1.0 / step))]
        assert len(set(due)) == 10
        assert due == sorted(due)
    assert [due_index(i * 0.02, 0.02) for i in range(100_000)] == list(range(100_000))


class _Sloppy(_Driver):
    """Says what the wire cannot carry."""

    def tick(self, tick: Tick) -> None:
        self.mailbox.publish(KEYS.drive(self.name), m.Drive(twist=Twist(np.float64(0.5), 0.0)))


class _Changeable(_Driver):
    """Says what others in its process could change."""

    def tick(self, tick: Tick) -> None:
        poses = structs.replace(m.Poses(bodies=()), bodies=[])
        self.mailbox.publish(KEYS.poses, poses)


@pytest.mark.parametrize(("kind", "wrong"), [(_Sloppy, "numpy"), (_Changeable, "that arrives as it is")])
def test_strict_mode_finds_what_works_in_one_process_and_is_not_so_over_the_bus(
    kind: type[_Driver], wrong: str
) -> None:
    loose, strict = (Lockstep(_World([]), [kind("a", [])], strict=strict) for strict in (False, True))
    loose.step()
    with pytest.raises(TypeError, match=wrong):
        strict.step()


def test_nodes_are_started_once_before_their_first_tick() -> None:
    trace: list[str] = []

    class Starting(_Driver):
        def start(self) -> None:
            trace.append("start")

    executor = Lockstep(_World(trace), [Starting("a", trace)])
    assert trace == []
    executor.step()
    executor.step()
    assert trace.count("start") == 1
    assert trace[0] == "start"
