"""The page as a node: what it shows to its audience, and what it publishes for it."""

from dataclasses import replace

import pytest

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.pacing import LEASE
from vrg.errors import LaunchError
from vrg.testing.views import synthetic
from vrg.testing.views.viewers import Viewers
from vrg.ui.scene import Scene
from vrg.ui.web.node import WebNode
from vrg.ui.web.requests import ButtonPress, Inspect, PageButton, PageDrive, Wishes


@pytest.fixture
def audience():
    return Viewers()


@pytest.fixture
def node(keys, audience):
    return WebNode("web", Mailbox(), keys, audience, obstacles=synthetic.OBSTACLES)


@pytest.fixture
def match(keys):
    return synthetic.SyntheticMatch(keys)


def said(node):
    return [out.message.body for out in node.mailbox.collect()]


def test_it_shows_25_frames_a_second_and_each_call_once(node, match, audience):
    for number in range(351):
        match.step(node, number * node.period, number)
    assert 351 <= len(audience.frames) <= 353
    assert [call["number"] for call in audience.calls] == [1, 2]
    assert audience.frames[-1]["frame"]["clock"] == "0:14.0"


def test_a_page_that_lives_on_shows_the_next_match(node, match, audience):
    for number in range(351):
        match.step(node, number * node.period, number)
    node.mailbox.forget()  # as the executor does where the clock goes back
    for number in range(51):
        match.step(node, number * node.period, number)
    assert audience.frames[-1]["frame"]["clock"] == "0:02.0"


def test_a_fast_match_is_not_shown_at_every_tick(keys, node, match, audience):
    for number in range(400):
        time = number * node.period
        match.say(
            node.mailbox, keys.clock, m.Clock(time=time, tick=number, epoch=0, rate=10.0, estop=False), time, number
        )
        node.mailbox.handover(time)
        node.tick(Tick(time))
    assert len(audience.frames) <= 45


def test_nothing_is_drawn_up_while_nobody_looks_but_calls_are_kept(node, match, audience):
    audience.watched = False
    for number in range(351):
        match.step(node, number * node.period, number)
    assert len(audience.frames) == 2
    assert len(audience.calls) == 2
    audience.watched = True
    match.step(node, 14.1, 352)
    assert audience.frames[-1]["state"]["scores"][0]["points"] == 2


def test_a_command_is_published_once_with_a_lease_so_that_a_silent_page_drives_nobody(node, match, audience):
    match.step(node, 5.0, 0)
    audience.wish = Wishes(commands=(PageDrive(1, "nemo", 0.5, -0.2),))
    match.step(node, 5.05, 1)
    assert said(node) == [m.Manual(forward=0.5, turn=-0.2, lease=LEASE)]
    match.step(node, 5.1, 2)
    assert said(node) == []


def test_who_gives_back_gives_back_at_once_and_only_what_was_driven(node, match, audience):
    audience.wish = Wishes(given_back=("nemo",))
    match.step(node, 5.0, 0)
    assert said(node) == []
    audience.wish = Wishes(commands=(PageDrive(1, "nemo", 1.0, 0.0),))
    match.step(node, 5.05, 1)
    audience.wish = Wishes(given_back=("nemo",))
    match.step(node, 5.1, 2)
    assert [manual.lease for manual in said(node)] == [LEASE, 0.0]


def test_an_emergency_stop_gives_back_and_drops_what_comes_meanwhile(keys, node, match, audience):
    drive = Wishes(commands=(PageDrive(1, "nemo", 1.0, 0.0),))
    audience.wish = drive
    match.step(node, 5.0, 0)
    stopped = m.Clock(time=5.05, tick=1, epoch=0, rate=1.0, estop=True)
    for number in range(1, 4):
        audience.wish = drive
        match.say(node.mailbox, keys.clock, stopped, 5.0 + 0.05 * number, number)
        node.mailbox.handover(5.0 + 0.05 * number)
        node.tick(Tick(5.0 + 0.05 * number))
    assert [manual.lease for manual in said(node)][-1] == 0.0
    match.say(node.mailbox, keys.clock, m.Clock(time=5.2, tick=4, epoch=0, rate=1.0, estop=False), 5.2, 4)
    for number, forward in enumerate((1.0, 0.0, 1.0), 5):
        audience.wish = Wishes(commands=(PageDrive(1, "nemo", forward, 0.0),))
        node.mailbox.handover(5.0 + 0.1 * number)
        node.tick(Tick(5.0 + 0.1 * number))
    assert [manual.forward for manual in said(node)] == [0.0, 1.0], "what is still held must be let go once"


@pytest.mark.parametrize("silence", [0.35, 1.8])
def test_after_a_silence_what_is_still_held_does_not_drive_on(node, match, audience, silence):
    """The page, its connection, or the process of this node was frozen: the newest command waits when it goes on."""
    match.step(node, 5.0, 0)
    back = 5.25 + silence
    wanted = [(5.05, 1.0), (5.25, 1.0), (back, 1.0), (back + 0.05, 1.0), (back + 0.1, 0.0), (back + 0.15, 1.0)]
    for number, (time, forward) in enumerate(wanted, 1):
        audience.wish = Wishes(commands=(PageDrive(7, "nemo", forward, 0.0),))
        match.step(node, time, number)
    driven = [(manual.forward, manual.lease > 0) for manual in said(node)]
    assert driven == [(1.0, True), (1.0, True), (0.0, False), (0.0, True), (1.0, True)]
    assert audience.released == [7], "the page lets go, too, and then gives back"


def test_a_page_that_lets_go_and_drives_again_at_once_is_not_released_again(node, match, audience):
    """On a slow connection both come in one tick, and before them commands of hands that were not free yet."""
    match.step(node, 5.0, 0)
    drive = Wishes(commands=(PageDrive(7, "nemo", 1.0, 0.0),))
    for number, (time, wish) in enumerate(
        [(5.05, drive), *((6.0 + 0.05 * late, drive) for late in range(6)), (6.3, replace(drive, given_back=("nemo",)))]
    ):
        audience.wish = wish
        match.step(node, time, number)
    assert audience.released == [7], "an answer to each of them would meet the next drive"
    assert [manual.forward for manual in said(node)] == [1.0, 0.0, 1.0]


def test_a_match_that_is_as_fast_as_possible_can_be_driven(keys, node, match, audience):
    for number in range(3):
        time = 100.0 * number
        fast = m.Clock(time=time, tick=number, epoch=0, rate=0.0, estop=False)
        match.say(node.mailbox, keys.clock, fast, time, number)
        node.mailbox.handover(time)
        audience.wish = Wishes(commands=(PageDrive(7, "nemo", 1.0, 0.0),))
        node.tick(Tick(time))
    assert [manual.forward for manual in said(node)][-1] == 1.0
    assert audience.released == []


@pytest.mark.parametrize("held", [True, False], ids=["commands go on", "no command comes meanwhile"])
def test_after_a_clock_that_had_stopped_what_is_still_held_does_not_drive_on(node, match, audience, held):
    drive = Wishes(commands=(PageDrive(7, "nemo", 1.0, 0.0),))
    match.step(node, 5.0, 0)
    audience.wish = drive
    match.step(node, 5.05, 1)
    audience.wish = drive if held else Wishes()
    node.tick(Tick(5.05, live=False))
    audience.wish = drive
    match.step(node, 5.1, 2)
    assert [(manual.forward, manual.lease > 0) for manual in said(node)] == [(1.0, True), (0.0, False)]
    audience.wish = Wishes(given_back=("nemo",))  # as the page does when it lets go
    match.step(node, 5.15, 3)
    audience.wish = drive
    match.step(node, 5.2, 4)
    assert [manual.forward for manual in said(node)] == [1.0]


def test_a_player_that_another_person_drives_is_refused_and_the_page_reads_why(keys, node, match, audience):
    taken = m.Report(mode="Cross/Go", armed=True, manual=True)
    match.step(node, 5.0, 0)
    match.say(node.mailbox, keys.report("nemo"), taken, 5.1, 1)
    node.mailbox.handover(5.1)
    node.tick(Tick(5.1))
    audience.wish = Wishes(commands=(PageDrive(7, "nemo", 1.0, 0.0),))
    node.tick(Tick(5.2))
    assert said(node) == []
    assert audience.told == [(7, "Another person drives nemo.")]
    assert audience.released == [7]


def test_the_lease_holds_in_real_time_in_a_match_that_is_fast(keys, node, match, audience):
    match.say(node.mailbox, keys.clock, m.Clock(time=1.0, tick=0, epoch=0, rate=2.0, estop=False), 1.0, 0)
    node.mailbox.handover(1.0)
    node.tick(Tick(1.0))
    audience.wish = Wishes(commands=(PageDrive(1, "nemo", 1.0, 0.0),))
    node.tick(Tick(1.1))
    assert [manual.lease for manual in said(node)] == [2 * LEASE]


def test_without_a_clock_nobody_is_driven_but_everything_can_be_stopped(node, match, audience):
    match.step(node, 5.0, 0)
    stop = ButtonPress(1, "driver of nemo (web)", PageButton.ESTOP)
    audience.wish = Wishes(commands=(PageDrive(1, "nemo", 1.0, 0.0),), decisions=(stop,))
    node.tick(Tick(5.0, live=False))
    assert said(node) == [m.Estop(by="driver of nemo (web)")]
    assert audience.frames[-1]["state"]["banners"][0]["heading"] == "NO CLOCK"


@pytest.mark.parametrize("what", [PageButton.HALT, PageButton.RESUME, PageButton.RECOVER, PageButton.END])
def test_decisions_are_published_and_the_referees_answer_goes_to_who_has_decided(keys, node, match, audience, what):
    audience.wish = Wishes(decisions=(ButtonPress(7, "official (web)", what),))
    match.step(node, 5.0, 0)
    [asked] = said(node)
    assert (asked.action.value, asked.by) == (what.value, "official (web)")
    answer = m.Call(number=9, rule="refused", text="not now", players=(), poses=(), clock=5.0, answers=asked.id)
    match.say(node.mailbox, keys.referee_event, answer, 5.0, 9)
    match.step(node, 5.05, 1)
    match.step(node, 5.1, 2)
    assert audience.told == [(7, "not now")]
    assert audience.calls == [], "what was refused is told to nobody else"


@pytest.mark.parametrize("what", [PageButton.DISQUALIFY, PageButton.REINSTATE])
def test_a_player_of_the_match_is_disqualified_and_reinstated(node, match, audience, what):
    match.step(node, 5.0, 0)
    match.step(node, 5.05, 1)
    audience.wish = Wishes(
        decisions=(ButtonPress(7, "official (web)", what, "nemo"), ButtonPress(8, "official (web)", what))
    )
    match.step(node, 5.1, 2)
    [asked] = said(node)
    assert (asked.action.value, asked.subject) == (what.value, "nemo")
    assert audience.told == [(8, "Select a player first.")]


def test_without_an_officials_seat_it_stops_everything_and_decides_nothing(keys, match, audience):
    node = WebNode("web", Mailbox(), keys, audience, official=False)
    audience.wish = Wishes(decisions=tuple(ButtonPress(7, "official (web)", what) for what in PageButton))
    match.step(node, 5.0, 0)
    assert said(node) == [m.Estop(by="official (web)")]
    assert len(audience.told) == len(PageButton) - 1
    assert "no official's seat" in audience.told[0][1]


class Tally:
    """The content of a drawer, which keeps what it is asked."""

    def __init__(self) -> None:
        self.listens = False

    def take(self, now: float) -> None:
        self.listens = True

    def close(self) -> None:
        self.listens = False

    def part(self, now: float, scene: Scene, player: str) -> dict[str, object]:
        return {"player": player, "players": [each.name for each in scene.players]}


@pytest.fixture
def tally():
    return Tally()


@pytest.fixture
def drawn(keys, audience, tally):
    """A page with a drawer."""
    return WebNode("web", Mailbox(), keys, audience, drawers={"tally": tally})


def wanted(*players: str, drawer: str = "tally") -> frozenset[Inspect]:
    return frozenset(Inspect(drawer=drawer, player=player) for player in players)


def test_drawers_are_drawn_up_now_and_then_for_those_that_are_wanted_and_only_while_they_are(drawn, match, audience):
    def ticks(first: int, count: int) -> list[str]:
        """What drawers show in the frames of so many ticks."""
        del audience.frames[:]
        for number in range(first, first + count):
            match.step(drawn, number * drawn.period, number)
        return [name for frame in audience.frames for name in frame if name.startswith("drawer")]

    assert ticks(0, 50) == []
    audience.inspected = wanted("", "nemo", "nobody")
    found = ticks(50, 250)
    assert set(found) == {"drawer/tally/", "drawer/tally/nemo", "drawer/tally/nobody"}
    assert audience.frames[0].keys() & set(found) == set(), "until then nothing has been heard"
    [unknown] = [frame["drawer/tally/nobody"] for frame in audience.frames if "drawer/tally/nobody" in frame][-1:]
    assert unknown["data"]["player"] == "", "nobody is no player"
    assert 16 <= found.count("drawer/tally/nemo") <= 20, "in 10 s"
    [shown] = [frame["drawer/tally/nemo"] for frame in audience.frames if "drawer/tally/nemo" in frame][-1:]
    assert shown == {"t": "drawer", "drawer": "tally", "data": {"player": "nemo", "players": list(synthetic.NAMES)}}
    audience.inspected = wanted("gill")
    assert ticks(300, 1) == ["drawer/tally/gill"], "who selects another player need not wait"
    audience.inspected = wanted("gill", drawer="another")
    assert ticks(301, 50) == [], "there is no such drawer"
    audience.inspected = frozenset()
    assert ticks(351, 50) == []


def test_a_drawer_listens_only_while_somebody_has_it_open(drawn, match, audience, tally):
    for number, (opened, watched) in enumerate([((), True), (("",), True), (("",), True), ((), False)]):
        audience.inspected, audience.watched = wanted(*opened), watched
        match.step(drawn, 5.0 + number, number)
        assert tally.listens == bool(opened)
    audience.inspected = wanted("", drawer="another")
    match.step(drawn, 9.0, 4)
    assert not tally.listens


def test_another_page_of_the_match_does_not_take_an_answer_for_its_own(keys, match):
    one, other = Viewers(), Viewers()
    nodes = [WebNode("web", Mailbox(), keys, audience) for audience in (one, other)]
    one.wish = Wishes(decisions=(ButtonPress(7, "official (web)", PageButton.HALT),))
    other.wish = Wishes(decisions=(ButtonPress(8, "official (web)", PageButton.RESUME),))
    for node in nodes:
        match.step(node, 5.0, 0)
    [asked], [_] = (said(node) for node in nodes)
    answer = m.Call(number=9, rule="refused", text="not now", players=(), poses=(), clock=5.0, answers=asked.id)
    for node in nodes:
        match.say(node.mailbox, keys.referee_event, answer, 5.0, 9)
        match.step(node, 5.05, 1)
        match.step(node, 5.1, 2)
    assert (one.told, other.told) == ([(7, "not now")], [])


def test_the_emergency_stop_and_its_release_have_keys_of_their_own(node, match, audience):
    decisions = tuple(ButtonPress(1, "official (web)", what) for what in (PageButton.ESTOP, PageButton.RELEASE))
    audience.wish = Wishes(decisions=decisions)
    match.step(node, 5.0, 0)
    assert said(node) == [m.Estop(by="official (web)"), m.EstopRelease(by="official (web)")]


def test_stopping_gives_players_back_and_shows_the_last_picture(node, match, audience):
    node.start()
    audience.wish = Wishes(commands=(PageDrive(1, "nemo", 1.0, 0.0),))
    match.step(node, 5.0, 0)
    said(node)
    node.stop()
    node.stop()
    assert said(node) == [m.Manual(forward=0.0, turn=0.0, lease=0.0)]
    assert audience.events == ["start", "stop", "stop"]


def test_a_server_that_has_failed_ends_the_node_so_that_it_is_started_again(node, audience):
    audience.failure = LaunchError("the page cannot be served")
    with pytest.raises(LaunchError, match="cannot be served"):
        node.tick(Tick(1.0))
