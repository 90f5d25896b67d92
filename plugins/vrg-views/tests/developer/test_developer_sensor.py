"""A sensor of somebody else stands in the details of its player, and on the field."""

import math

from heard import KEYS, Bench

from vrg.hal.models import MODELS
from vrg.hal.sensors import message_class
from vrg_views.developer.layers import SENSORS, shapes


def test_the_details_of_its_player_have_it_in_words_and_the_field_where_it_is_drawn(
    needle: None,
) -> None:
    message, pathfinder = message_class("needle"), MODELS.get("Pathfinder")
    assert message is not None
    bench, body = Bench(2, robot=pathfinder), message(heading=math.pi)
    bench.tell(KEYS.sensor(type(body), "robot1", "main"), body)
    bench.ticks(1)
    insight = bench.insight("robot1")
    assert insight.words["robot/robot1/sensor/needle/main"] == "180° from east"
    [mark] = shapes(insight)[SENSORS]
    pose = bench.pose("robot1")
    assert {round(math.dist(point, (pose.x, pose.y)), 1) for point in mark.points} == {
        round(1.3 * math.hypot(*pathfinder.size) / 2, 1)
    }
