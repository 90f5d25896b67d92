"""What the page is told of a scene."""

import json

import pytest

from vrg.bus import messages as m
from vrg.colours import mix
from vrg.games import GAMES
from vrg.testing.views import synthetic
from vrg.ui import palette
from vrg.ui.scene import Scene
from vrg.ui.web import parts


def test_the_ground_has_zones_and_walls_with_the_colours_of_the_window(scene_at):
    ground = json.loads(parts.parts(scene_at(5.0, zones=synthetic.four_shapes()))["ground"])
    figures = {figure["name"]: figure for figure in ground["figures"]}
    words = [figure["writing"]["lines"] for figure in figures.values() if "writing" in figure]
    assert words == [["CORNER ZONE"], ["ISLAND"], ["GATE"]]
    assert figures["zone corner"]["shapes"][0]["fill"] == list(mix(palette.FIELD, palette.SAFE, 0.2))
    assert len([name for name in figures if name.startswith("wall")]) == len(synthetic.OBSTACLES)
    assert ground["box"][0] < synthetic.X_MIN < synthetic.X_MAX < ground["box"][2]


def test_the_state_says_stage_score_and_players(scene_at):
    state = parts.state(scene_at(13.0))
    assert state["title"] == "Sharks and Minnows"
    assert [chip["words"] for chip in state["chips"]] == ["Playing, pass 1 of 2"]
    assert [(score["team"], score["points"]) for score in state["scores"]] == [("Sharks", 2), ("Minnows", 0)]
    gill = next(player for player in state["players"] if player["name"] == "gill")
    assert (gill["deed"], gill["out"]) == ("inactive", True)
    assert [player["name"] for player in state["players"] if player["physical"]] == ["bruce", "nemo"]
    assert (state["over"], state["stage"], state["waiting"]) == (False, "play_round", ())
    shapes = {body["name"]: body["figure"].shapes for body in parts.looks(scene_at(13.0))["bodies"]}
    assert [name for name, of in shapes.items() if of[-1].still] == ["gill", "squirt"], "they have a cross"
    assert [name for name, of in shapes.items() if of[1].fill == palette.TEXT] == ["bruce", "nemo"], "a light rim"


def test_a_frame_has_the_bodies_in_the_order_of_the_state(scene_at):
    scene = scene_at(9.5)
    frame, looks = parts.frame(scene), parts.looks(scene)
    for body, (x, y, _) in zip(looks["bodies"], frame["bodies"], strict=True):
        pose = synthetic.pose_at(body["name"], 9.5)
        assert (x, y) == pytest.approx((pose.x, pose.y), abs=0.001)
    assert frame["clock"] == "0:09.5"
    assert [flash.label.words for flash in frame["flashes"]] == ["TAG"]


def test_a_frame_of_16_robots_is_small(scene_at):
    scene = scene_at(5.0)
    bodies = (*scene.bodies, *scene.bodies, *scene.bodies[:2])
    crowd = Scene(**{**vars(scene), "bodies": bodies, "players": (*scene.players, *scene.players)[:14]})
    assert len(parts.encode(parts.frame(crowd))) < 800


def test_before_the_referee_has_spoken_the_page_says_what_it_waits_for():
    state = parts.state(Scene())
    [banner] = state["banners"]
    assert "match is starting" in banner["lines"][0]
    assert state["chips"] == []


def test_a_halt_is_told_with_its_reason_and_hinders_whoever_drives(scene_at):
    state = parts.state(scene_at(5.0, halted="a dog is on the field", way_out="an official continues"))
    [banner] = state["banners"]
    assert banner["lines"] == ("a dog is on the field", "an official continues")
    assert all("halted" in player["hindrance"] for player in state["players"])
    assert parts.state(scene_at(5.0))["players"][0]["hindrance"] == ""


def test_a_call_carries_its_rule():
    [tag, _] = synthetic.calls(13.0)
    told = json.loads(parts.call(tag, "sharks-and-minnows"))
    assert (told["number"], told["clock"], told["rule"]) == (1, "0:09.0", "Tag")
    rule = GAMES.get("sharks-and-minnows").rule_text("tag")
    assert rule is not None
    assert (told["words"], told["source"]) == (rule.words, rule.source)


def test_marks_are_shown_while_players_line_up(scene_at):
    players = [
        m.PlayerStatus(
            name="ann",
            team="a",
            role="minnow",
            state="active",
            may_move=True,
            radius=0.3,
            mark=synthetic.pose_at("nemo", 0),
        )
    ]
    assert len(parts.looks(scene_at(1.0, players=players, stage=m.Stage.INITIALIZE))["marks"]) == 1
    assert parts.looks(scene_at(1.0, players=players))["marks"] == []
