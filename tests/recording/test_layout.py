"""The layout for Foxglove."""

import json
import re

from tests.recording.recordings import messages_of, record
from vrg.bus.topics import Keys
from vrg.recording.layout import foxglove_layout
from vrg.testing.views import synthetic

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
    assert seen == {topic for topic in newest if topic in ("/view/map", "/view/field", "/view/scene")}
    assert panels["RosOut!calls"]["topicToRender"] == "/view/calls"
    assert "/view/nemo/laser/front" in panels["3D!match"]["topics"]
    for panel in ("Plot!battery", "StateTransitions!stage"):
        for line in panels[panel]["paths"]:
            topic, _, value = line["value"].rpartition(".")
            assert value in newest[topic], line
    bodies = {body["name"]: body for body in newest["/poses"]["bodies"]}
    for line in panels["Plot!speed"]["paths"]:
        found = re.fullmatch(r'(/\w+)\.bodies\[:\]\{name=="(\w+)"\}\.twist\.(\w)', line["value"])
        assert (found[1], found[2]) == ("/poses", line["label"])
        assert found[3] in bodies[found[2]]["twist"]


def test_a_name_in_another_language_is_written_as_in_keys_and_in_messages():
    panels = foxglove_layout({"Ärztin": [], "p1": []}, (0.0, 0.0), 10.0)["configById"]
    speeds, charges = ([line["value"] for line in panels[of]["paths"]] for of in ("Plot!speed", "Plot!battery"))
    assert speeds[0] == '/poses.bodies[:]{name=="Ärztin"}.twist.v'
    assert charges == [f"{Keys('m').report('Ärztin').key.removeprefix('vrg/m')}.battery", "/player/p1/report.battery"]
