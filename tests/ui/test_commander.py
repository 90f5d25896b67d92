"""The commander: buttons, the gamepad, and the messages that follow."""

import os
from collections.abc import Iterator

import pygame
import pytest

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.pacing import LEASE
from vrg.bus.topics import Keys
from vrg.games.roboflag import GAME
from vrg.testing.views.virtual_pad import VirtualPad
from vrg.types import STILL, Pose, Twist
from vrg.ui.acts import Act, Press
from vrg.ui.commander.deck import Deck
from vrg.ui.commander.node import Commander
from vrg.ui.driving import DEAD_ZONE, SLOW, Driving, radial
from vrg.ui.window.pads import Pads

REDS = ("red1", "red2", "red3", "red4")
RIGHT, LEFT = pygame.CONTROLLER_BUTTON_RIGHTSHOULDER, pygame.CONTROLLER_BUTTON_LEFTSHOULDER
FACES = (
    pygame.CONTROLLER_BUTTON_A,
    pygame.CONTROLLER_BUTTON_B,
    pygame.CONTROLLER_BUTTON_X,
    pygame.CONTROLLER_BUTTON_Y,
)
DIRECTIONS = (
    pygame.CONTROLLER_BUTTON_DPAD_UP,
    pygame.CONTROLLER_BUTTON_DPAD_RIGHT,
    pygame.CONTROLLER_BUTTON_DPAD_DOWN,
    pygame.CONTROLLER_BUTTON_DPAD_LEFT,
)
PRIORITIES = [priority.name for priority in GAME.priorities]


def sent(mailbox: Mailbox) -> list[tuple[str, m.Message]]:
    return [(out.topic.key, out.message.body) for out in mailbox.collect()]


@pytest.fixture
def deck(keys: Keys) -> Deck:
    mailbox = Mailbox()
    return Deck(mailbox, keys, "red", Driving(mailbox, keys), GAME.priorities, REDS)


class TestDeck:
    def test_without_an_order_it_says_nothing(self, deck: Deck) -> None:
        deck.send()
        assert sent(deck.mailbox) == []

    def test_a_face_button_sets_a_priority_another_replaces_it_and_the_same_ends_it(self, deck: Deck) -> None:
        for index in (0, 3):
            deck.order(index)
            deck.send()
            [(key, order)] = sent(deck.mailbox)
            assert key.endswith("team/red/order")
            assert order == m.TeamOrder(priority=PRIORITIES[index], lease=1.0)
        deck.order(3)
        deck.send()
        deck.send()
        [(_, order)] = sent(deck.mailbox)
        assert order == m.TeamOrder(priority=None, lease=1.0), "the end is told once"

    def test_face_buttons_set_nothing_while_a_player_is_driven(self, deck: Deck) -> None:
        deck.driving.take("red1")
        deck.order(1)
        assert deck.priority is None

    def test_a_button_without_a_priority_does_nothing(self, deck: Deck) -> None:
        deck.priorities = ()
        deck.order(0)
        assert deck.priority is None

    def test_further_pages_have_the_players_beyond_the_fourth(self, deck: Deck) -> None:
        deck.players = [f"minnow{n}" for n in range(6)]
        assert list(deck.shown) == ["minnow0", "minnow1", "minnow2", "minnow3"]
        deck.driving.take("minnow5")
        assert list(deck.shown) == ["minnow4", "minnow5"]

    def test_closing_ends_the_priority(self, deck: Deck) -> None:
        deck.order(0)
        deck.send()
        deck.mailbox.collect()
        deck.close()
        [(_, order)] = sent(deck.mailbox)
        assert order == m.TeamOrder(priority=None, lease=1.0)


class TestSticks:
    def test_inside_the_dead_zone_there_is_nothing(self) -> None:
        assert radial(DEAD_ZONE * 0.6, -DEAD_ZONE * 0.6) == (0.0, 0.0)

    def test_it_grows_from_the_border_of_the_zone_to_the_end(self) -> None:
        x, y = radial(0.0, -(DEAD_ZONE + 0.01))
        assert (x, y) == pytest.approx((0.0, -0.0118), abs=1e-3)
        assert radial(1.0, 0.0) == pytest.approx((1.0, 0.0))

    def test_a_corner_is_no_faster_than_an_edge(self) -> None:
        x, y = radial(1.0, 1.0)
        assert x * x + y * y == pytest.approx(1.0)


class Bench:
    """A commander's window with a virtual gamepad."""

    def __init__(self, keys: Keys, team: str = "red") -> None:
        os.environ["SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS"] = "1"
        self.keys = keys
        self.node = Commander(team, Mailbox(), keys, size=(900, 600))
        self.time = 0.0
        self.score = {"red": 0, "blue": 0}
        self.calls: list[m.Call] = []
        self.tick()
        self.pad = VirtualPad()
        self.tick()

    def tick(self, *, sight: m.Sight | None = None) -> list[m.Message]:
        """One tick; what was published."""
        self.time += 0.05
        node = self.node
        for body in (state_of(self.score, hidden=sight is not None), sight, *self.calls):
            for inlet in node.mailbox.inlets:
                if body is not None and inlet.topic.type is type(body):
                    inlet.offer(Received(inlet.topic.key, self.time, round(self.time * 20), body))
        self.calls = []
        node.mailbox.handover(self.time)
        node.tick(Tick(self.time))
        return [body for _, body in sent(node.mailbox)]

    def press(self, *buttons: int) -> list[m.Message]:
        """Press and release buttons, one after the other; what was published meanwhile."""
        found = []
        for button in buttons:
            self.pad.button(button, True)
            found += self.tick()
            self.pad.button(button, False)
            found += self.tick()
        return found


def state_of(score: dict[str, int], *, hidden: bool = False) -> m.RefereeState:
    players = [
        m.PlayerStatus(
            name=f"{team}{number}", team=team, role=team, state="normal", may_move=True, radius=0.35,
            pose=None if hidden else Pose(number, 0.0, 0.0),
            lease=Twist(0.1, 0.0) if (team, number) == ("red", 4) else None,
        )
        for team in ("red", "blue")
        for number in range(1, 5)
    ]  # fmt: skip
    return m.RefereeState(
        game="roboflag", stage=m.Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=1.0, total=1.0,
        round=1, rounds=2, score=dict(score), players=players, zones=(),
    )  # fmt: skip


@pytest.fixture
def bench(keys: Keys) -> Iterator[Bench]:
    bench = Bench(keys)
    yield bench
    bench.node.stop()


@pytest.fixture
def used(bench: Bench) -> Bench:
    """The same, with the gamepad in use: its first press does nothing else."""
    assert bench.press(FACES[0]) == []
    return bench


class TestGamepad:
    def test_the_first_press_only_takes_the_gamepad_into_use(self, bench: Bench) -> None:
        assert "press a button" in bench.node.pads.status
        assert bench.press(FACES[2]) == []
        assert bench.node.pads.status.startswith("gamepad:")

    @pytest.mark.parametrize("index", range(4))
    def test_all_four_priorities(self, used: Bench, index: int) -> None:
        orders = [body for body in used.press(FACES[index]) if isinstance(body, m.TeamOrder)]
        assert {order.priority for order in orders} == {PRIORITIES[index]}
        assert used.node.deck.priority == PRIORITIES[index]

    @pytest.mark.parametrize("index", range(4))
    def test_each_player_is_selected_and_driven(self, used: Bench, index: int) -> None:
        used.press(DIRECTIONS[index])
        used.pad.button(RIGHT, True)
        used.pad.axis(pygame.CONTROLLER_AXIS_LEFTY, -1.0)
        used.tick()
        [ahead] = used.tick()
        assert ahead == m.Manual(forward=SLOW, turn=0.0, lease=LEASE)
        assert used.node.deck.selected == REDS[index]
        used.pad.axis(pygame.CONTROLLER_AXIS_LEFTY, 0.0)
        used.pad.axis(pygame.CONTROLLER_AXIS_LEFTX, -1.0)
        used.pad.button(LEFT, True)
        used.tick()
        [left] = used.tick()
        assert left == m.Manual(forward=0.0, turn=1.0, lease=LEASE)

    def test_the_right_stick_and_page_keys_climb_and_sink(self, used: Bench) -> None:
        used.press(DIRECTIONS[0])
        used.pad.button(RIGHT, True)
        used.pad.axis(pygame.CONTROLLER_AXIS_RIGHTY, -1.0)
        used.tick()
        [up] = used.tick()
        assert up == m.Manual(forward=0.0, turn=0.0, climb=SLOW, lease=LEASE)
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_PAGEDOWN, mod=0))
        [down] = used.tick()
        assert down == m.Manual(forward=0.0, turn=0.0, climb=-SLOW, lease=LEASE)
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.K_PAGEDOWN, mod=0))
        used.pad.axis(pygame.CONTROLLER_AXIS_RIGHTY, 0.1)
        used.tick()
        [still] = used.tick()
        assert still == m.Manual(forward=0.0, turn=0.0, lease=LEASE), "that is within its dead zone"

    def test_a_players_button_changes_over_and_the_same_one_gives_back(self, used: Bench) -> None:
        gives_back = m.Manual(forward=0.0, turn=0.0, lease=0.0)
        used.press(DIRECTIONS[0])
        assert gives_back in used.press(DIRECTIONS[3])
        assert used.node.deck.selected == "red4"
        assert gives_back in used.press(DIRECTIONS[3])
        assert used.node.deck.selected is None

    def test_a_players_button_without_a_player_does_nothing(self, used: Bench) -> None:
        used.node.press(Press(Act.PLAYER, 7))
        assert used.node.deck.selected is None

    def test_the_first_two_buttons_drive_ahead_and_back(self, used: Bench) -> None:
        used.press(DIRECTIONS[0])
        used.pad.button(RIGHT, True)
        used.pad.button(FACES[0], True)
        used.tick()
        assert used.tick() == [m.Manual(forward=SLOW, turn=0.0, lease=LEASE)]
        used.pad.button(FACES[0], False)
        used.pad.button(FACES[1], True)
        used.tick()
        assert used.tick() == [m.Manual(forward=-SLOW, turn=0.0, lease=LEASE)]

    def test_another_gamepad_takes_over_only_when_a_button_is_pressed(self, used: Bench) -> None:
        other = VirtualPad()
        used.tick()
        other.button(FACES[1], True)
        used.tick()
        assert used.node.deck.priority is None, "one gamepad is in use already"
        used.pad.unplug()
        used.tick()
        assert used.node.pads.active is None
        other.button(FACES[1], False)
        other.button(FACES[2], True)
        used.tick()
        assert used.node.pads.active is not None
        assert used.node.deck.priority is None

    def test_it_shakes_for_a_tag_of_an_own_player_and_for_a_score(
        self, used: Bench, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        shaken: list[float] = []
        monkeypatch.setattr(Pads, "rumble", lambda _self, strength, _seconds: shaken.append(strength))
        used.calls = [_tag("blue1")]
        used.tick()
        assert shaken == []
        used.calls = [_tag("red1")]
        used.tick()
        assert shaken == [0.6]
        used.score["blue"] = 1
        used.tick()
        assert shaken == [0.6, 1.0]


def _tag(name: str) -> m.Call:
    return m.Call(number=1, rule="tag", text="tag", players=(name,), poses=(Pose(0.0, 0.0, 0.0),), clock=1.0)


class TestWindow:
    def test_keys_serve_as_a_gamepad(self, bench: Bench) -> None:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_y, mod=0))
        assert m.TeamOrder(priority=PRIORITIES[3], lease=1.0) in bench.tick()
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_2, mod=0))
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_UP, mod=0))
        assert m.Manual(forward=SLOW, turn=0.0, lease=LEASE) in bench.tick()

    def test_the_priority_is_shown_large_in_its_colour(self, bench: Bench) -> None:
        def yellow() -> int:
            shown = pygame.display.get_surface()
            assert shown is not None
            pixels = pygame.surfarray.array3d(shown)
            return int(((pixels == (240, 228, 66)).all(axis=-1)).sum())

        _until_drawn(bench)
        before = yellow()
        bench.press(FACES[0], FACES[3])
        _until_drawn(bench)
        assert yellow() > before + 5000

    def test_with_a_limited_view_only_what_the_team_sees_is_drawn(self, bench: Bench) -> None:
        bodies = [m.Body(name, Pose(0.0, 0.0, 0.0), STILL, False) for name in ("red1", "blue1")]
        for inlet in bench.node.mailbox.inlets:
            if inlet.topic.type is m.Poses:
                inlet.offer(Received(inlet.topic.key, bench.time, 1, m.Poses(bodies=bodies)))
        for _ in range(3):
            bench.tick(sight=m.Sight(poses={"red1": Pose(0.0, 0.0, 0.0)}))
        assert [body.name for body in bench.node.scene.bodies] == ["red1"]

    def test_a_player_that_the_referee_drives_is_said_to_be(self, used: Bench) -> None:
        used.press(DIRECTIONS[3])
        assert used.node.hindrance() == "the referee drives it"


def _until_drawn(bench: Bench) -> None:
    for _ in range(3):
        bench.tick()
