"""The page in Chromium, served on the loopback, with made-up scenes in place of a match."""

import json
import math
import random
from collections.abc import Callable
from dataclasses import replace

import pytest

from vrg.bus.messages import Stage, Zone
from vrg.colours import hexadecimal
from vrg.regions import Rectangle
from vrg.testing.views import synthetic
from vrg.testing.views.browser import LAYOUT, SIZES, Visitor
from vrg.types import Pose
from vrg.ui.labels import Placer, Wanted, line_to
from vrg.ui.scene import Scene, SceneBody, ScenePlayer
from vrg.ui.web import parts
from vrg.ui.web.requests import PageButton, Wishes
from vrg.ui.web.server import WebServer

FIELD = Rectangle(0.0, 0.0, 20.0, 12.0)


def crowd(count: int, time: float = 0.0) -> Scene:
    """Robots in rows that drive along x."""
    columns = math.ceil(math.sqrt(2 * count))
    names = [f"player{number}" for number in range(1, count + 1)]
    places = [
        (2.0 + 16.0 * (i % columns) / columns, 1.5 + 9.0 * (i // columns) / math.ceil(count / columns))
        for i in range(count)
    ]
    bodies = tuple(
        SceneBody(name, Pose(x + 0.2 * time, y, 0.3 * i), 0.5, 0.45, ("shark", "minnow")[i > 0], "active", False, ())
        for i, (name, (x, y)) in enumerate(zip(names, places, strict=True))
    )
    players = tuple(
        ScenePlayer(
            b.name, f"{b.role}s", b.role, b.state, True, speed=0.2, battery=0.8, mode="Minnow/Cross", armed=True
        )
        for b in bodies
    )
    return Scene(
        live=True, time=time, game="sharks-and-minnows", stage=Stage.PLAY_ROUND, clock=time, round=1, rounds=2,
        score=(("sharks", 3), ("minnows", 12)), players=players, bodies=bodies,
        zones=(Zone(name="field", kind="field", region=FIELD),),
    )  # fmt: skip


class TestPureParts:
    """Functions of the page that draw nothing."""

    def run(self, visit, module: str, work: str):
        script = f"async () => {{ const m = await import(`${{location.origin}}/{module}`); {work} }}"
        return visit().page.evaluate(script)

    def test_the_field_is_turned_where_that_shows_it_larger(self, visit):
        found = self.run(
            visit,
            "view.js",
            """const box = [0, 0, 20, 10], high = { left: 0, top: 0, width: 100, height: 200 };
            const view = m.fit(box, high), lying = m.fit(box, { left: 0, top: 0, width: 200, height: 100 });
            return [view.turned, view.scale, m.point(view, 10, 5), m.point(view, 20, 5),
                lying.turned, m.point(lying, 20, 10), m.fit(box, { ...high, height: 90 }, high).turned];""",
        )
        assert found == [True, 10, [50, 100], [50, 200], False, [200, 0], True]

    def test_a_page_can_be_asked_to_turn_the_field_by_quarters(self, visit):
        found = self.run(
            visit,
            "view.js",
            """const box = [0, 0, 20, 10], area = { left: 0, top: 0, width: 200, height: 200 };
            return [0, 90, 180, -90].map((turn) => {
                const view = m.fit(box, area, area, m.asked(`?turn=${turn}`)), [x, y] = m.point(view, 20, 10);
                const ahead = m.point(view, 11, 5), to = Math.atan2(view.top - ahead[1], ahead[0] - view.left);
                return [x, y, ...m.place(view, x, y), Math.cos(m.angle(view, 0) - to)].map((one) => Math.round(one));
            }).concat([["", "?turn=45", "?turn=x", "?turn=270"].map(m.asked)]);""",
        )
        corners = [[200, 50], [150, 200], [0, 150], [50, 0]]
        assert found == [*([*corner, 20, 10, 1] for corner in corners), [0, 0, 0, 3]]

    def test_between_two_frames_robots_are_on_the_way_and_after_the_last_they_wait(self, visit):
        found = self.run(
            visit,
            "motion.js",
            """const motion = new m.Motion(), frame = (time, x, h) => ({ time, rate: 1, bodies: [[x, 0, h]] });
            for (let i = 0; i <= 4; i++) motion.take(frame(i * 0.05, i * 0.1, 3.1 + i * 0.05), 10 + i * 0.05);
            const placed = m.between([0, 0, 0], [5, 0, 0], 0.5);
            return [motion.at(10.2 + 0.025)[0], motion.at(99)[0], motion.at(10)[0], placed];""",
        )
        assert found[0][:2] == pytest.approx([0.25, 0.0])
        assert found[0][2] == pytest.approx(3.225)
        assert found[1] == pytest.approx([0.4, 0.0, 3.3])
        assert found[2] == [0, 0, 3.1]
        assert found[3] == [0, 0, 0], "a robot that was put elsewhere jumps"

    def test_time_that_goes_back_begins_anew(self, visit):
        found = self.run(
            visit,
            "motion.js",
            """const motion = new m.Motion();
            for (const time of [5, 5.05, 1]) motion.take({ time, rate: 1, bodies: [[time, 0, 0]] }, 10);
            return [motion.frames.length, motion.at(10)[0], motion.trails[0].points.length];""",
        )
        assert found == [1, [1, 0, 0], 1]

    def test_a_stick_has_a_dead_zone_and_reaches_all_of_the_speed(self, visit):
        found = self.run(
            visit,
            "controls.js",
            """return [m.deflection(0.05, 0.05, 0.15), m.deflection(0, -1, 0.15), m.deflection(1, 0, 0.15),
                m.deflection(3, 4, 0.15), ...[["ArrowUp", "ArrowUp", "ArrowLeft"],
                ["ArrowUp", "ArrowDown"], ["KeyX"]].map(m.keysSum)];""",
        )
        assert found[:3] == [[0, 0], [1, 0], [0, -1]]
        assert math.hypot(*found[3]) == pytest.approx(1.0)
        assert found[4:] == [[1, 1], [0, 0], [0, 0]]

    def test_the_pauses_between_attempts_grow_to_a_bound(self, visit):
        found = self.run(visit, "link.js", "return [0, 1, 2, 9].map((attempt) => m.pause(attempt, 0.5));")
        assert found == [0.5, 1, 2, 5]

    def test_a_stop_is_done_when_what_is_heard_after_it_was_sent_tells_of_it_and_not_before(self, visit):
        found = self.run(
            visit,
            "stop.js",
            """let open = false, sent = 0;
            const stop = new m.PendingStop(() => open && ++sent > 0), told = [];
            const look = (...what) => told.push(stop.look(...what), stop.stands, sent);
            stop.press(0);
            look(0, -Infinity, true);  // no connection; the match was stopped when the server was heard last
            open = true;
            look(600, 590, true);
            look(700, 690, true);  // this may be an older stop, which is just released
            look(1000, 990, true);
            stop.press(2000);
            look(40000, 39000, false);
            return told;""",
        )
        assert found == [False, "unsent", 0, False, "sending", 1, False, "sending", 1, False, "", 1, True, "", 1]

    @pytest.mark.parametrize(("robots", "apart"), [(7, 200), (16, 30), (16, 110)], ids=["few", "crowd", "many"])
    def test_words_are_placed_as_in_windows(self, visit, robots, apart):
        rng, places = random.Random(4), []
        while len(places) < robots:
            at = (rng.randrange(-40, 840), rng.randrange(-40, 540))
            if all(math.dist(at, other) > apart for other in places):
                places.append(at)
        area, painted = (0.0, 0.0, 800.0, 500.0), (300.0, 200.0, 420.0, 260.0)
        circles = [(at, 14.0) for at in places]
        placer = Placer()
        close = placer.crowded(circles, 80.0)
        texts = [f"{number} out" if close else f"robot {number} out" for number in range(10, 10 + robots)]
        wanted = [Wanted(text, (10.0 * len(text) + 10.0, 18.0), of) for text, of in zip(texts, circles, strict=True)]
        boxes = [placer.place(wanted, area, [painted]) for _ in range(2)][1]
        found = self.run(
            visit,
            "labels.js",
            f"""const placer = new m.Placer(), area = {{ left: 0, top: 0, width: 800, height: 500 }};
            const painted = [{{ left: 300, top: 200, width: 120, height: 60 }}];
            const robots = {json.dumps(places)}.map(([x, y], index) => ({{ name: `robot ${{index}}`,
                label: {{ words: `robot ${{index + 10}}`, short: `${{index + 10}}`, remark: "out" }},
                circle: {{ x, y, radius: 14 }} }}));
            const measure = (text) => [10 * text.length, 18];
            placer.place(robots, area, measure, painted);
            return placer.place(robots, area, measure, painted).map(({{ text, box, line }}) => [
                text, [box.left, box.top, box.left + box.width, box.top + box.height], line?.flat() ?? null]);""",
        )
        assert [text for text, _, _ in found] == texts
        assert [box for _, box, _ in found] == [pytest.approx(box) for box in boxes]
        lines = [line_to(box, circle) for box, circle in zip(boxes, circles, strict=True)]
        assert [line for _, _, line in found] == [
            None if line is None else pytest.approx([*line[0], *line[1]]) for line in lines
        ]

    def test_where_there_are_buttons_in_place_of_keys_a_step_names_its_button(self, visit):
        steps = '["1. U releases the stop", "R lets robots clear their faults", "C continues play", "drive on"]'
        found = self.run(visit, "panel.js", f"return {steps}.map((step) => m.buttonStep(step));")
        assert found == ["1. press “Release the stop”", "press “Recover robots”", "press “Continue”", "drive on"]


@pytest.mark.parametrize("who", ["", "official", "player2"], ids=["viewer", "official", "driver"])
def test_everything_has_room(visit, server, who):
    page = visit(who)
    for width, height in SIZES:
        page.page.set_viewport_size({"width": width, "height": height})
        for count in (2, 7, 16):
            server.show(parts.parts(crowd(count)))
            page.wait(f"vrg.field.plates.length === {count}")
            page.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
            good = {"cut": [], "covered": False, "scrolls": False, "reachable": True, "field": True}
            assert page.page.evaluate(LAYOUT) == good, f"{count} players at {width}x{height}"


@pytest.mark.parametrize("who", ["", "official", "player2"], ids=["viewer", "official", "driver"])
def test_on_a_telephone_what_must_be_read_stands_above_the_field(visit, server, who):
    page = visit(who, SIZES[2])
    server.show(parts.parts(replace(crowd(7), halted="a dog is on the field", way_out="an official continues")))
    page.wait_text("#banners", "a dog is on the field")
    top, bottom = (page.page.locator(box).bounding_box() for box in ("#banners", "#ground"))
    assert top["y"] + top["height"] <= bottom["y"]
    assert bottom["height"] > 80


@pytest.mark.parametrize("who", ["", "official"], ids=["viewer", "official"])
def test_on_a_telephone_all_players_and_the_newest_call_are_seen_without_scrolling(visit, server, who):
    server.show(parts.parts(crowd(20)), [parts.call(call, "sharks-and-minnows") for call in synthetic.calls(20.0)])
    page = visit(who, SIZES[2])
    page.wait("document.querySelectorAll('#players .player').length === 20 && vrg.match.calls.length === 2")
    hidden = page.page.evaluate("""() => {
        const inside = (own, list) => own.top >= list.top - 1 && own.bottom <= list.bottom + 1;
        const box = (element) => element.getBoundingClientRect();
        const players = document.getElementById("players"), calls = document.getElementById("calls");
        const cut = [...players.querySelectorAll(".player")].filter((row) => !inside(box(row), box(players)));
        if (!inside(box(calls.firstElementChild), box(calls))) cut.push(calls.firstElementChild);
        return cut.map((element) => element.textContent);
    }""")
    assert hidden == []


def test_robots_are_drawn_where_they_are_and_move(visit, server):
    page = visit()
    for tick in range(3):
        server.show(parts.parts(crowd(2, 0.05 * tick)))
        page.wait(f"vrg.match.motion.latest?.time === {0.05 * tick:.2f}")
    body = crowd(2, 0.1).bodies[1]
    blue = hexadecimal(parts.looks(crowd(2))["bodies"][1]["figure"].shapes[2].fill)
    page.wait("performance.now() / 1000 > vrg.match.motion.offset + 0.3")
    # Beside the sign in its middle.
    behind = (body.pose.x - 0.2 * math.cos(body.pose.theta), body.pose.y - 0.2 * math.sin(body.pose.theta))
    assert page.colour_at(*behind) == blue
    page_text = page.text("#head")
    assert "Sharks and Minnows" in page_text
    assert "0:00.1" in page_text
    server.show(parts.parts(crowd(2, 5.0)))
    page.wait("vrg.match.motion.latest.time === 5 && vrg.match.motion.at(performance.now() / 1000)[1][0] > 9")
    page.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert page.colour_at(*behind) != blue


def test_calls_are_listed_with_their_rule_also_for_late_viewers(visit, server):
    server.show(parts.parts(crowd(2)), [parts.call(call, "sharks-and-minnows") for call in synthetic.calls(20.0)])
    page = visit()
    page.wait("vrg.match.calls.length === 2")
    page.wait_text("#calls li:first-child", "squirt is out of bounds")
    page.wait_text("#calls li:last-child .law", "Tag")


def test_a_page_that_is_opened_before_the_match_says_what_it_waits_for(visit, server):
    server.show(parts.parts(Scene()))
    page = visit()
    page.wait_text("#banners", "The match is starting")
    server.show(parts.parts(crowd(7)))
    page.wait_text("#title", "Sharks and Minnows")
    page.wait("!document.querySelector('.banner')")


def test_the_token_is_not_left_in_the_address(visit):
    official = visit("official")
    official.wait("vrg.match.role === 'official'")
    assert "#" not in official.page.url
    official.page.reload()
    official.wait("vrg.match.role === 'official'")


def test_without_a_drawer_the_page_has_no_button_and_loads_nothing_for_one(visit):
    official = visit("official&details")
    official.wait("vrg.match.role === 'official'")
    assert official.page.locator("#drawers button").count() == 0
    assert official.page.evaluate("[vrg.drawers.name, vrg.drawers.open]") == ["", None]


class TestDriving:
    @pytest.fixture
    def driver(self, visit, server) -> Visitor:
        server.show(parts.parts(crowd(7)))
        page = visit("player2")
        page.wait_text("#seat-state", "player2 plays by itself")
        return page

    def wait(self, driver: Visitor, server: WebServer, wanted: Callable[[Wishes], bool], what: str) -> None:
        """Wait until the page has wished for what is wanted."""
        for _ in range(1000):
            if wanted(server.wishes()):
                return
            driver.page.wait_for_timeout(20)
        raise AssertionError(f"{what} did not come")

    def wait_command(self, driver: Visitor, server: WebServer, good: Callable[[float, float], bool]) -> None:
        """Wait for a command that is as wanted."""

        def came(wishes: Wishes) -> bool:
            return any(c.player == "player2" and good(c.forward, c.turn) for c in wishes.commands)

        self.wait(driver, server, came, "such a command")

    def wait_given_back(self, driver: Visitor, server: WebServer) -> None:
        """Wait until the player was given back."""
        self.wait(driver, server, lambda wishes: "player2" in wishes.given_back, "the end of driving")

    def wait_stop(self, driver: Visitor, server: WebServer) -> None:
        """Wait until the driver has stopped everybody."""
        stop = (PageButton.ESTOP, "driver of player2 (web)")
        self.wait(driver, server, lambda wishes: stop in [(d.what, d.by) for d in wishes.decisions], "the stop")

    def test_nobody_is_driven_before_a_hand_is_at_the_controls(self, driver, server):
        driver.page.wait_for_timeout(200)
        assert server.wishes().commands == ()

    def test_arrow_keys_drive_and_when_they_are_up_the_robot_stands(self, driver, server):
        driver.page.keyboard.down("ArrowUp")
        driver.page.keyboard.down("ArrowLeft")
        self.wait_command(driver, server, lambda forward, turn: forward == turn == 0.5)
        driver.page.keyboard.down("Shift")
        driver.page.keyboard.up("ArrowLeft")
        self.wait_command(driver, server, lambda forward, turn: (forward, turn) == (1.0, 0.0))
        for key in ("ArrowUp", "Shift"):
            driver.page.keyboard.up(key)
        self.wait_command(driver, server, lambda forward, turn: forward == turn == 0.0)
        driver.wait_text("#seat-state", "stands while you hold nothing")
        driver.page.click("#give-back")
        driver.wait_text("#seat-state", "plays by itself")

    def test_a_telephones_screen_stays_on_while_its_person_drives(self, driver):
        driver.page.evaluate(
            """() => {
                window.locks = 0;
                const request = async () => ((window.locks += 1), { release: async () => (window.locks -= 1) });
                Object.defineProperty(navigator, "wakeLock", { value: { request } });
            }"""
        )
        driver.page.keyboard.down("ArrowUp")
        driver.page.wait_for_function("() => window.locks === 1")
        driver.page.keyboard.up("ArrowUp")
        driver.wait_text("#seat-state", "stands while you hold nothing")
        assert driver.page.evaluate("() => window.locks") == 1
        driver.page.click("#give-back")
        driver.page.wait_for_function("() => window.locks === 0")

    def test_after_all_was_let_go_a_new_key_counts_at_once_and_a_switch_only_after_it_was_free(self, driver, server):
        found = driver.page.evaluate(
            """() => {
                const controls = window.vrg.controls, hands = [], look = () => hands.push(controls.hands !== null);
                const pressed = { pressed: true, value: 1 }, free = { pressed: false, value: 0 };
                const pad = { id: "pad", index: 0, mapping: "standard", connected: true, axes: [0, -1] };
                pad.buttons = Array(17).fill(free);
                navigator.getGamepads = () => [pad];
                controls.letGo();
                controls.press("ArrowUp", true);
                look();
                pad.buttons = Array(17).fill(free).with(controls.rules.deadman, pressed);
                controls.letGo();
                look();
                pad.buttons = Array(17).fill(free);
                look();
                pad.buttons = Array(17).fill(free).with(controls.rules.deadman, pressed);
                look();
                controls.letGo();
                return hands;
            }"""
        )
        assert found == [True, False, False, True]

    def test_a_gamepad_that_is_silent_for_long_holds_nothing_until_its_switch_was_free(self, driver, server):
        """The battery of the gamepad is empty, and its dongle is still plugged in."""
        found = driver.page.evaluate(
            """() => {
                const controls = window.vrg.controls, hands = [], look = () => hands.push(controls.hands !== null);
                const pressed = { pressed: true, value: 1 }, free = { pressed: false, value: 0 };
                const held = Array(17).fill(free).with(controls.rules.deadman, pressed);
                const pad = { id: "pad", index: 0, mapping: "standard", connected: true, axes: [0, -1], buttons: held };
                const age = (seconds) => (pad.timestamp = performance.now() - 1000 * seconds);
                navigator.getGamepads = () => [pad];
                controls.letGo();
                pad.buttons = Array(17).fill(free);
                age(0), look();
                pad.buttons = held;
                age(0), look();
                age(controls.rules.silence + 1), look();
                age(0), look();
                pad.buttons = Array(17).fill(free);
                age(0), look();
                pad.buttons = held;
                age(0), look();
                controls.letGo();
                return hands;
            }"""
        )
        assert found == [False, True, False, False, False, True]

    def test_a_switch_that_is_held_when_its_gamepad_appears_must_be_free_once(self, driver):
        """After a reload, and where a gamepad was lost for a moment, the browser shows none at first."""
        found = driver.page.evaluate(
            """() => {
                const controls = window.vrg.controls, hands = [], look = () => hands.push(controls.hands !== null);
                const pad = { id: "pad", index: 0, mapping: "standard", connected: true, axes: [0, -1] };
                const free = { pressed: false };
                const buttons = (pressed) => Array(17).fill(free).with(controls.rules.deadman, { pressed });
                const press = (pressed) => (pad.buttons = buttons(pressed));
                controls.letGo();
                navigator.getGamepads = () => [];
                look();
                navigator.getGamepads = () => [pad];
                press(true), look();
                press(false), look();
                press(true), look();
                controls.letGo();
                return hands;
            }"""
        )
        assert found == [False, False, False, True]

    def test_a_page_that_the_server_has_released_lets_go_and_what_is_still_held_does_not_drive_on(self, driver, server):
        guests: list[int] = []

        def steers(wishes: Wishes) -> bool:
            guests.extend(command.guest for command in wishes.commands if command.turn)
            return bool(guests)

        driver.page.keyboard.down("ArrowLeft")
        self.wait(driver, server, steers, "a command")
        server.tell(guests[0], "You do not drive player2 now.", released=True)
        self.wait_given_back(driver, server)
        driver.wait_text("#notice", "You do not drive player2 now.")
        driver.wait_text("#seat-state", "plays by itself")
        server.wishes()
        driver.page.keyboard.down("ArrowLeft")  # as a key that is held repeats
        driver.page.wait_for_timeout(150)
        assert server.wishes().commands == ()
        driver.page.keyboard.up("ArrowLeft")
        driver.page.keyboard.down("ArrowLeft")
        self.wait_command(driver, server, lambda forward, turn: turn == 0.5)

    def test_the_stick_drives_as_long_as_it_is_held(self, driver, server):
        box = driver.page.locator("#stick").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        driver.page.mouse.move(x, y)
        driver.page.mouse.down()
        driver.page.mouse.move(x, y - box["height"])
        self.wait_command(driver, server, lambda forward, turn: forward == pytest.approx(0.5) and abs(turn) < 0.01)
        driver.page.mouse.up()
        self.wait_command(driver, server, lambda forward, turn: forward == turn == 0.0)

    def test_a_gamepad_drives_while_a_shoulder_button_is_held_and_one_that_goes_away_stops(self, driver, server):
        driver.page.evaluate(
            """() => {
                const buttons = [...Array(17)].map(() => ({ pressed: false, value: 0 }));
                window.testPad = { id: "pad of the test", index: 0, mapping: "standard", connected: true, buttons };
                window.testPad.axes = [0, -1, 0, 0];
                navigator.getGamepads = () => (window.testPad ? [window.testPad] : []);
            }"""
        )
        driver.wait_text("#seat-pad", "pad of the test")
        driver.page.wait_for_timeout(150)
        assert server.wishes().commands == ()
        driver.page.evaluate("() => (window.testPad.buttons[5].pressed = true)")
        self.wait_command(driver, server, lambda forward, turn: (forward, turn) == (0.5, 0.0))
        driver.page.evaluate("() => (window.testPad.buttons[8].pressed = true)")
        self.wait_stop(driver, server)
        driver.page.evaluate(
            """() => {
                const gamepad = window.testPad;
                window.testPad = null;
                window.dispatchEvent(Object.assign(new Event("gamepaddisconnected"), { gamepad }));
            }"""
        )
        self.wait_given_back(driver, server)
        driver.wait_text("#seat-pad", "gamepad is lost")

    def test_a_gamepad_whose_buttons_the_browser_does_not_know_is_refused_in_words(self, driver, server):
        """Its buttons have other numbers: one that is held may be any."""
        found = driver.page.evaluate(
            """() => {
                const { controls } = window.vrg, buttons = Array(17).fill({ pressed: true, value: 1 });
                const pad = { id: "strange pad", index: 0, mapping: "", connected: true, axes: [0, -1], buttons };
                const hands = [], look = () => hands.push(controls.hands !== null);
                navigator.getGamepads = () => [pad];
                look();
                pad.buttons = Array(17).fill({ pressed: false, value: 0 });
                look();
                pad.buttons = buttons;
                look();
                return hands;
            }"""
        )
        assert found == [False, False, False]
        driver.wait_text("#seat-pad", "does not know the buttons of strange pad")
        wishes = server.wishes()
        assert (wishes.commands, wishes.decisions) == ((), ())

    def test_a_page_that_is_hidden_or_closed_gives_the_player_back(self, driver, server):
        driver.page.keyboard.down("ArrowUp")
        self.wait_command(driver, server, lambda forward, turn: forward == 0.5)
        driver.page.evaluate(
            """() => {
                Object.defineProperty(document, "hidden", { value: true, configurable: true });
                document.dispatchEvent(new Event("visibilitychange"));
            }"""
        )
        driver.wait_text("#notice", "You left this page")
        self.wait_given_back(driver, server)
        driver.page.wait_for_timeout(150)
        assert server.wishes().commands == ()

    def test_an_emergency_stop_gives_back_and_what_is_still_held_does_not_drive_on(self, driver, server):
        driver.page.keyboard.down("ArrowUp")
        self.wait_command(driver, server, lambda forward, turn: forward == 0.5)
        server.show(parts.parts(replace(crowd(7), estop=True)))
        self.wait_given_back(driver, server)
        server.show(parts.parts(crowd(7)))
        driver.page.keyboard.down("ArrowUp")  # as a key that is held repeats
        driver.wait("!vrg.match.state.estop")
        driver.page.wait_for_timeout(150)
        assert server.wishes().commands == ()
        driver.page.keyboard.up("ArrowUp")
        driver.page.keyboard.down("ArrowUp")
        self.wait_command(driver, server, lambda forward, turn: forward == 0.5)
        driver.page.keyboard.press("Space")
        self.wait_stop(driver, server)
        driver.page.keyboard.down("Control")
        driver.page.keyboard.down("Space")
        self.wait_stop(driver, server)

    def test_a_second_tab_is_refused_and_can_take_over(self, driver, visit):
        second = visit("player2")
        second.wait_text("#door", "Another page drives player2 already")
        assert driver.page.evaluate("vrg.match.role") == "seat"
        second.page.click("#door-takeover")
        second.wait("vrg.match.role === 'seat'")
        driver.wait_text("#door", "Another page has taken the seat")
        driver.page.click("#door-watch")
        driver.wait("vrg.match.role === 'viewer' && vrg.link.open")


def test_the_officials_buttons_ask_for_what_they_say_and_the_end_is_confirmed(visit, server):
    page = visit("official")
    asked: list[str] = []
    page.wait("vrg.match.role === 'official'")
    for button in ("halt", "resume", "recover", "release"):
        page.page.click(f"#{button}")
    # The referee's words name the keys of the spectator's window.
    for key in "hcru":
        page.page.keyboard.press(key)
    for _ in range(2):
        page.page.click("#end")
    for _ in range(1000):
        asked += [decision.what for decision in server.wishes().decisions]
        if "end" in asked:
            break
        page.page.wait_for_timeout(20)
    assert asked == [*2 * ["halt", "resume", "recover", "release"], "end"]


def test_an_emergency_stop_is_sent_again_until_the_bus_has_it_and_says_so_meanwhile(browser, page_admission):
    button = "document.querySelector('#official .estop').textContent"
    first = WebServer(page_admission, "final")
    first.start()
    page = Visitor(browser, f"http://127.0.0.1:{page_admission.port}/#{page_admission.official}")
    page.wait("vrg.match.role === 'official'")
    first.stop()
    page.wait("!vrg.link.open")
    page.page.keyboard.press("Space")
    page.wait(f"{button} === 'NOT SENT, trying again'")
    server = WebServer(page_admission, "final")
    server.start()
    asked: list[str] = []
    while len(asked) < 2:  # the process that took the first may have died with it
        asked += [decision.what for decision in server.wishes().decisions]
        page.page.wait_for_timeout(20)
    assert set(asked) == {PageButton.ESTOP}
    server.show(parts.parts(replace(crowd(3), estop=True)))
    page.wait(f"{button} === 'EMERGENCY STOP' && vrg.stop.stands === ''")
    page.close()
    server.stop()


def test_a_viewer_that_tries_to_halt_is_told_that_it_may_not(visit, server):
    page = visit()
    page.wait("vrg.link.open")
    page.page.evaluate("vrg.link.send({ t: 'act', what: 'halt' })")
    page.wait_text("#notice", "Refused: deciding needs the official's link")
    assert server.wishes().decisions == ()


def test_a_wrong_link_is_told_and_the_page_can_be_watched_without_it(browser, server, page_admission):
    page = Visitor(browser, f"http://127.0.0.1:{page_admission.port}/#wrong")
    page.wait_text("#door", "token does not belong to this match")
    page.page.click("#door-watch")
    page.wait("vrg.link.open && vrg.match.role === 'viewer'")
    page.close()


def test_after_the_end_the_last_picture_stays_and_a_lost_connection_comes_back(browser, page_admission):
    first = WebServer(page_admission, "final")
    first.start()
    first.show(parts.parts(crowd(7, 30.0)))
    page = Visitor(browser, f"http://127.0.0.1:{page_admission.port}/#{page_admission.official}")
    page.wait("vrg.field.plates.length === 7")
    assert page.page.locator("#halt").is_visible()
    first.stop()
    page.wait_text("#link-words", "The match has ended")
    assert page.page.locator("#halt").is_hidden(), "there is nothing to decide any more"
    assert page.page.evaluate("vrg.field.plates.length") == 7
    again = WebServer(page_admission, "final")
    again.start()
    again.show(parts.parts(crowd(7, 31.0)))
    page.wait("vrg.link.open && !vrg.match.ended && vrg.match.motion.latest?.time === 31")
    again._loop.call_soon_threadsafe(lambda: [g.socket._req.transport.abort() for g in again._guests.values()])
    page.wait_text("#link-words", "connection is lost")
    page.wait("vrg.link.open")
    again.stop()
    page.close()
