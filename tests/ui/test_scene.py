"""What there is to see, gathered from messages."""

import math
from dataclasses import replace
from itertools import count

import pytest
from msgspec import structs

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.colours import YELLOW
from vrg.games import game_of
from vrg.games.game import Game, Shown, title
from vrg.testing.views import synthetic
from vrg.types import Pose, Twist
from vrg.ui import picture
from vrg.ui.builder import CALLS_KEPT, FLASH_SECONDS, TRAIL_SECONDS, TRAIL_STEP, SceneBuilder, SceneInlets
from vrg.ui.headline import headline
from vrg.ui.scene import Scene, clock_text
from vrg.ui.web import parts


@pytest.fixture
def builder() -> SceneBuilder:
    """What makes scenes, and has heard nothing yet."""
    return SceneBuilder()


def test_a_scene_shows_every_body_with_its_role_and_state(scene_at):
    scene = scene_at(13.5)
    bodies = {body.name: body for body in scene.bodies}
    assert set(bodies) == set(synthetic.NAMES)
    assert (bodies["bruce"].role, bodies["bruce"].physical) == ("shark", True)
    assert (bodies["gill"].state, bodies["gill"].out_of_play) == ("inactive", True)
    assert not bodies["nemo"].out_of_play
    assert not any(player.out_of_play for player in scene_at(13.5, game="a-game-from-elsewhere").players)
    assert bodies["nemo"].pose == synthetic.pose_at("nemo", 13.5)


def test_a_scene_tells_the_match(scene_at):
    scene = scene_at(13.5, halted="a cable", waiting=["dory is not armed"])
    assert (scene.game, scene.stage, scene.round, scene.rounds) == ("sharks-and-minnows", m.Stage.PLAY_ROUND, 1, 2)
    assert (scene.clock, scene.time, scene.halted, scene.waiting) == (13.5, 13.5, "a cable", ("dory is not armed",))
    assert scene.score == (("sharks", 2), ("minnows", 0))
    assert [call.rule for call in scene.calls] == ["tag", "out_of_bounds"]


def test_before_the_first_message_a_scene_is_empty_and_not_live():
    assert SceneBuilder().build(live=True) == Scene(live=False)


def test_a_trail_has_a_bounded_length(scene_at):
    trail = scene_at(30.0).bodies[0].trail
    assert len(trail) <= TRAIL_SECONDS / TRAIL_STEP + 1
    assert trail[-1] == (synthetic.pose_at("bruce", 30.0).x, synthetic.pose_at("bruce", 30.0).y)


def test_a_robot_that_is_placed_elsewhere_leaves_no_trail_across_the_field(builder):
    for tick, x in enumerate((0.0, 0.2, 0.4, 9.0)):
        body = m.Body(name="a", pose=Pose(x, 0.0, 0.0), twist=Twist(1.0, 0.0), physical=False)
        builder.poses(m.Poses(bodies=(body,)), tick * 0.2)
    assert builder.build(True).bodies[0].trail == ((9.0, 0.0),)


def test_trails_begin_anew_when_the_world_restarts(builder):
    builder.clock(m.Clock(time=5.0, tick=5, epoch=0, rate=1.0, estop=False))
    builder.poses(synthetic.poses(5.0), 5.0)
    builder.clock(m.Clock(time=4.0, tick=4, epoch=1, rate=1.0, estop=False))
    builder.poses(synthetic.poses(4.0), 4.0)
    assert all(len(body.trail) == 1 for body in builder.build(True).bodies)


def test_only_the_last_calls_are_kept(builder):
    for number in range(1, CALLS_KEPT + 10):
        builder.call(m.Call(number=number, rule="tag", text="", players=(), poses=(), clock=0.0), 0.0)
    assert [call.number for call in builder.build(True).calls] == list(range(10, CALLS_KEPT + 10))


def test_what_an_official_was_refused_pushes_no_call_off_the_list(builder):
    builder.call(m.Call(number=1, rule="tag", text="", players=(), poses=(), clock=0.0), 0.0)
    for number in range(2, 100):
        builder.call(m.Call(number=number, rule="refused", text="", players=(), poses=(), clock=0.0), 0.0)
    assert [call.number for call in builder.build(True).calls] == [1]


def flashes(builder, time, rate=1.0):
    builder.clock(m.Clock(time=time, tick=1, epoch=0, rate=rate, estop=False))
    return builder.build(True).flashes


def test_a_tag_flashes_where_it_happened_for_a_moment_but_not_again_when_the_world_restarts(builder):
    builder.referee(synthetic.state(9.0))
    builder.call(synthetic.calls(9.0)[0], 9.0)
    [flash] = flashes(builder, 9.5)
    tagged = synthetic.pose_at("gill", synthetic.TAGGED_AT)
    assert (flash.at, flash.word) == ((tagged.x, tagged.y), "tag")
    assert flash.share == pytest.approx(0.5 / FLASH_SECONDS)
    assert flashes(builder, 9.0 + FLASH_SECONDS) == ()
    assert len(flashes(builder, 9.0 + FLASH_SECONDS, rate=4.0)) == 1, "a moment is real time"
    builder.clock(m.Clock(time=9.0, tick=1, epoch=1, rate=1.0, estop=False))
    assert builder.build(True).flashes == ()


def test_only_calls_that_the_game_marks_flash(builder):
    builder.referee(synthetic.state(9.0))
    for rule in ("begin", "pass_over", "refused", "disqualified"):
        pose = synthetic.pose_at("gill", 9.0)
        builder.call(m.Call(number=1, rule=rule, text="", players=("gill",), poses=(pose,), clock=9.0), 9.0)
    assert [flash.word for flash in flashes(builder, 9.1)] == ["disqualified"]


def test_a_players_speed_and_battery_are_known(builder):
    builder.referee(synthetic.state(0.0))
    assert (builder.build(True).player("dory").speed, builder.build(True).player("dory").battery) == (None, None)
    builder.poses(synthetic.poses(0.0), 0.0)
    builder.report("dory", m.Report(mode="x", armed=True, battery=0.25))
    dory = builder.build(True).player("dory")
    assert (dory.speed, dory.battery) == (0.9, 0.25)


def test_the_emergency_stop_is_shown_until_it_is_released_everywhere(builder):
    builder.estop(m.Estop(by="anna", reason="smoke"))
    assert builder.build(True).estop
    assert builder.build(True).estop_reason == "pressed by anna: smoke"
    builder.clock(m.Clock(time=1.0, tick=1, epoch=0, rate=1.0, estop=True))
    builder.estop(m.EstopRelease(by="anna"))
    assert builder.build(True).estop, "the world's own latch still holds"
    builder.clock(m.Clock(time=1.1, tick=2, epoch=0, rate=1.0, estop=False))
    assert not builder.build(True).estop


def test_a_player_says_what_it_does_and_what_ails_it(builder):
    builder.referee(synthetic.state(0.0))
    builder.report("dory", m.Report(mode="Minnow/Cross", armed=True, manual=True, fault="no laser"))
    dory = builder.build(True).player("dory")
    assert dory is not None
    assert (dory.mode, dory.armed, dory.manual, dory.fault) == ("Minnow/Cross", True, True, "no laser")
    builder.report("dory", m.Report(mode="-", armed=False, fault="axis 2: overvoltage", latched=True))
    dory = builder.build(True).player("dory")
    assert (dory.fault, dory.latched) == ("axis 2: overvoltage", True)
    assert builder.build(True).player("nobody") is None


def test_the_inlets_bring_everything_that_a_scene_is_made_of(keys):
    mailbox = Mailbox()
    inlets, builder = SceneInlets(mailbox, keys), SceneBuilder(sizes={"nemo": (0.4, 0.3)})
    match = synthetic.SyntheticMatch(keys)
    for topic, body in (
        (keys.clock, m.Clock(time=9.0, tick=9, epoch=0, rate=2.0, estop=False)),
        (keys.poses, synthetic.poses(9.0)),
        (keys.referee_state, synthetic.state(9.0)),
        (keys.report("nemo"), m.Report(mode="x", armed=True)),
        (keys.estop, m.Estop(by="anna")),
        (keys.referee_event, synthetic.calls(9.0)[0]),
    ):
        match.say(mailbox, topic, body, 9.0, 0)
    mailbox.handover(9.0)
    assert [call.rule for call in inlets.feed(builder)] == ["tag"]
    scene = builder.build(True)
    nemo = next(body for body in scene.bodies if body.name == "nemo")
    assert (scene.live, scene.rate, scene.estop, len(scene.calls), nemo.length) == (True, 2.0, True, 1, 0.4)
    assert scene.player("nemo").armed
    assert inlets.feed(builder) == []


def test_the_emergency_stop_is_shown_as_robots_latch_it(keys):
    mailbox, match, builder = Mailbox(), synthetic.SyntheticMatch(keys), SceneBuilder()
    inlets, numbers = SceneInlets(mailbox, keys), count()

    def stopped_after(now, *messages, stamp=None):
        match.say(mailbox, keys.clock, m.Clock(time=now, tick=9, epoch=0, rate=1.0, estop=False), now, 0)
        for topic, body in messages:
            match.say(mailbox, topic, body, now if stamp is None else stamp, next(numbers))
        mailbox.handover(now)
        inlets.feed(builder)
        scene = builder.build(True)
        return (scene.estop, scene.estop_reason)

    def referee(estop):
        return keys.referee_state, synthetic.state(9.0, estop=estop)

    pressed = (True, "pressed by anna")
    assert stopped_after(1.0, (keys.estop, m.Estop(by="anna"))) == pressed
    assert stopped_after(1.1, referee(estop=False)) == pressed, "of which the referee has not heard yet"
    assert stopped_after(1.2, referee(estop=True)) == pressed
    assert stopped_after(2.0, referee(estop=False), stamp=1.3) == pressed, "what the referee said long ago"
    assert stopped_after(2.1, referee(estop=False)) == (False, ""), "the release was missed"
    assert stopped_after(3.0, (keys.estop, m.Estop(by="anna"))) == pressed
    assert stopped_after(3.1, (keys.estop_release, m.EstopRelease(by="anna"))) == (False, "")
    assert stopped_after(4.0, referee(estop=True)) == (True, ""), "the order was missed"


def test_words_are_written_as_people_write_them():
    assert title("sharks-and-minnows") == "Sharks and Minnows"
    assert title("play_round") == "Play Round"
    assert game_of("sharks-and-minnows").round_word == "pass"
    assert game_of("a-game-from-elsewhere").round_word == "round"
    assert clock_text(83.46) == "1:23.4"
    assert clock_text(math.nextafter(0.3, 0)) == "0:00.3"


def test_the_headline_tells_why_the_score_is_so_and_what_goes_on_now(builder):
    builder.referee(synthetic.state(1.0, round=1))
    builder.call(m.Call(number=1, rule="tag", text="gill is tagged by bruce", players=(), poses=(), clock=9.0), 9.0)
    assert headline(builder.build(True)).reason == "0:09  gill is tagged by bruce"
    flag = m.FieldObject(name="red flag", kind="flag", x=0.0, y=0.0, team="red", carrier="nemo")
    builder.referee(synthetic.state(21.0, round=2, objects=(flag,)))
    head = headline(builder.build(True))
    assert head.reason == "pass 1, 0:09  gill is tagged by bruce", "a time of an earlier round is told as such"
    assert head.drama == "nemo has the red flag · as it stands, minnows win"


def test_the_score_names_who_is_ahead_and_what_may_come_while_nobody_moves():
    def drama(score, **states):
        players = [
            m.PlayerStatus(name=name, team=f"{name[:-1]}s", role=name[:-1], state=state, may_move=state == "crossing",
                           radius=0.3)
            for name, state in states.items()
        ]  # fmt: skip
        builder = SceneBuilder()
        changes = {"game": "pursuit-evasion", "score": dict(zip(("pursuers", "intruders"), score, strict=True))}
        builder.referee(synthetic.state(1.0, players=players, rounds=1, **changes))
        return headline(builder.build(True)).drama

    assert drama((0, 0), pursuer1="watching", intruder1="crossing", intruder2="waiting") == ""
    assert (
        drama((2, 1), pursuer1="watching", intruder1="captured", intruder2="crossing") == "as it stands, pursuers win"
    )
    soon = "as it stands, intruders win · the next intruder may come at any time"
    assert drama((0, 1), pursuer1="watching", intruder1="escaped", intruder2="waiting") == soon


def test_robots_out_of_play_are_told_apart_where_that_has_more_than_one_reason():
    remarks = [game_of("pursuit-evasion").remark(state) for state in ("captured", "escaped", "crossing")]
    assert remarks == ["captured", "escaped", ""]
    assert game_of("sharks-and-minnows").remark("inactive") == ""


def test_a_body_that_is_lost_is_an_outline_everywhere_and_said(builder):
    seen = m.FieldObject(name="ball", kind="ball", x=2.0, y=1.0, radius=0.1)
    objects = (seen, structs.replace(seen, name="other", lost=True))
    builder.referee(synthetic.state(1.0, objects=objects))
    scene = builder.build(True)
    assert [(thing.lost, thing.words) for thing in scene.objects] == [(False, ""), (True, "other is lost")]
    (one,), (other,) = (figure.shapes for figure in picture.moving(scene)[-2:])
    assert (one.fill, one.line) == (YELLOW, picture.DARK.border)
    assert (other.fill, other.line, other.radius) == (None, YELLOW, 0.1)
    page = parts.state(scene)["objects"]
    assert [part["figure"].shapes[0].fill for part in page] == [YELLOW, None]
    assert [part["words"] for part in page] == ["", "other is lost"]


def test_numbers_of_a_game_are_shown_in_its_words(monkeypatch):
    numbers = {"best": Shown("best run {:.2f} s"), "run": Shown("running for {:.1f} s", since=True)}
    shown = Game(name="maze", settings="", rules="", strategy="", match="", roles=(), numbers=numbers)
    monkeypatch.setattr("vrg.ui.headline.game_of", lambda _: shown)
    scene = Scene(game="maze", stage=m.Stage.PLAY_ROUND, clock=12.5, numbers={"run": 10.0, "best": 8.254, "other": 1.0})
    assert headline(scene).drama == "best run 8.25 s · running for 2.5 s"
    assert headline(replace(scene, score=(("mouse", 3),))).drama.endswith("2.5 s"), "who is alone does not lead"
    assert headline(replace(scene, numbers={})).drama == ""
    assert headline(replace(scene, stage=m.Stage.GAME_OVER)).drama == ""


def test_words_without_a_place_for_their_number_are_refused():
    for words in ("{} of {}", "{name}", "{:s}"):
        with pytest.raises((IndexError, KeyError, ValueError)):
            Shown(words)
