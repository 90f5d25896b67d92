"""The layout for Foxglove."""

import json

from tests.recording.recordings import messages_of, record
from tests.ui import synthetic
from vrg.recording.layout import foxglove_layout

NAMES = {name: ["laser/front"] for name in synthetic.NAMES}


def leaves(tree):
    return leaves(tree["first"]) + leaves(tree["second"]) if isinstance(tree, dict) else [tree]


def test_every_panel_has_a_place_and_every_place_a_panel():
    layout = foxglove_layout(NAMES, (21.0, -22.0), 30.0)
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    assert json.loads(json.dumps(layout)) == layout


def test_it_names_topics_and_values_that_a_recording_has(path):
    record(path, 1.0, obstacles=synthetic.OBSTACLES).stop()
    newest = {channel.topic: json.loads(message.data) for _, channel, message in messages_of(path)}
    panels = foxglove_layout(NAMES, (21.0, -22.0), 30.0)["configById"]
    seen = {topic for topic, how in panels["3D!match"]["topics"].items() if how["visible"]}
    assert seen == {topic for topic in newest if topic in ("/map", "/field", "/scene")}
    assert panels["RosOut!calls"]["topicToRender"] == "/referee/calls"
    assert "/robot/nemo/laser/front" in panels["3D!match"]["topics"]
    for panel in ("Plot!speed", "Plot!battery", "StateTransitions!stage"):
        for line in panels[panel]["paths"]:
            topic, _, value = line["value"].rpartition(".")
            assert value in newest[topic], line


def test_a_name_in_another_language_is_quoted_in_a_path():
    plot = foxglove_layout({"Ärztin": [], "p 1": [], "p1": []}, (0.0, 0.0), 10.0)["configById"]["Plot!speed"]
    assert [line["value"] for line in plot["paths"]] == [
        '"/robot/Ärztin/twist".v',
        '"/robot/p 1/twist".v',
        "/robot/p1/twist.v",
    ]
