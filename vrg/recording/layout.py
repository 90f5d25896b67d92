"""The layout in which Foxglove and Lichtblick show the recording of a match.

Panels are named by their type and an id of their own, as in a layout that Foxglove exports; the log panel is called
RosOut there.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from vrg.names import chunk_of
from vrg.portable.scalars import tan
from vrg.types import Vector

VIEW: Final = "/view/"
"""The beginning of the topics that only viewers read."""
FIELD_OF_VIEW: Final = 45.0
"""The vertical angle of the camera's view, degrees."""


def foxglove_layout(scans: Mapping[str, Sequence[str]], middle: Vector, width: float) -> dict[str, Any]:
    """The layout for a match: the scene, the referee's calls, the speeds and the batteries.

    Args:
        scans: the sensors of each robot that are drawn as scans, such as `laser/front`, by the robot's name.
        middle: where the camera looks, m. width: how much of the field it shows, m.
    """
    shown = [f"{VIEW}{part}" for part in ("map", "field", "scene")]
    hidden = [f"{VIEW}{robot}/{sensor}" for robot, sensors in scans.items() for sensor in sensors]
    panels: dict[str, dict[str, Any]] = {
        "3D!match": {
            "cameraState": {
                "distance": width / (2 * tan(math.radians(FIELD_OF_VIEW) / 2)), "perspective": True, "phi": 30.0,
                "thetaOffset": 0.0, "fovy": FIELD_OF_VIEW, "near": 0.5,
                "far": 5000.0, "target": [0.0, 0.0, 0.0], "targetOffset": [*middle, 0.0],
                "targetOrientation": [0.0, 0.0, 0.0, 1.0],
            },
            "followMode": "follow-none",
            "topics": {
                **{topic: {"visible": True} for topic in shown},
                # All scans at once hide the robots: a viewer switches on those that it wants to see.
                **{topic: {"visible": False, "pointSize": 3} for topic in hidden},
            },
        },
        "RosOut!calls": {"topicToRender": f"{VIEW}calls", "minLogLevel": 1, "searchTerms": []},
        "StateTransitions!stage": {
            "paths": [{"value": "/referee/state.stage", "label": "stage", "timestampMethod": "receiveTime"}],
            "isSynced": True,
        },
        "Plot!speed": _plot("Speed, m/s", {robot: f"/poses.bodies[:]{{name==\"{robot}\"}}.twist.v" for robot in scans}),
        "Plot!battery": _plot(
            "Battery, 0 to 1", {robot: f"/player/{chunk_of(robot)}/report.battery" for robot in scans}
        ),
    }  # fmt: skip
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split(
            "row",
            _split("column", "3D!match", "StateTransitions!stage", 88),
            _split("column", "RosOut!calls", _split("column", "Plot!speed", "Plot!battery", 60), 40),
            60,
        ),
    }


def _plot(title: str, values: Mapping[str, str]) -> dict[str, Any]:
    """A plot of values, whose paths are by their labels."""
    paths = [
        {"value": path, "label": label, "enabled": True, "timestampMethod": "receiveTime"}
        for label, path in values.items()
    ]
    return {
        "title": title,
        "paths": paths,
        "xAxisVal": "timestamp",
        "showLegend": True,
        "legendDisplay": "left",
        "isSynced": True,
    }


def _split(direction: str, first: object, second: object, percentage: int) -> dict[str, Any]:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percentage}
