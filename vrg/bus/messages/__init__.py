"""Every message that travels on the bus, one frozen struct each. The messages of sensors are in vrg.hal.sensors.

Numbers are bounded, so NaN and infinity never pass. A value that is not known is None, never 0.0.
The version of a message is raised whenever a field changes.
"""

from vrg.bus.messages.base import REASON_LENGTH, TEXT_LENGTH, Message, SensorMessage, shortened
from vrg.bus.messages.match import (
    DISQUALIFIED,
    FAILED,
    Auction,
    Call,
    Estop,
    Official,
    OfficialAction,
    PlayerStatus,
    RefereeState,
    Stage,
    Zone,
)
from vrg.bus.messages.player import (
    SAY_LIMIT,
    SIGHTINGS_LIMIT,
    SKETCH_LIMIT,
    Bid,
    Manual,
    Pulse,
    Report,
    Say,
    Sighting,
    Sightings,
    Sketch,
    Stroke,
)
from vrg.bus.messages.robot import CameraRequest, Drive, MeasuredPose, Placed, Recover, RobotState, SpeedLimit
from vrg.bus.messages.seat import SeatAnswer, SeatRequest
from vrg.bus.messages.world import Body, Clock, Poses, RequestKind, WorldAnswer, WorldRequest

__all__ = [
    "DISQUALIFIED",
    "FAILED",
    "REASON_LENGTH",
    "SAY_LIMIT",
    "SIGHTINGS_LIMIT",
    "SKETCH_LIMIT",
    "TEXT_LENGTH",
    "Auction",
    "Bid",
    "Body",
    "Call",
    "CameraRequest",
    "Clock",
    "Drive",
    "Estop",
    "Manual",
    "MeasuredPose",
    "Message",
    "Official",
    "OfficialAction",
    "Placed",
    "PlayerStatus",
    "Poses",
    "Pulse",
    "Recover",
    "RefereeState",
    "Report",
    "RequestKind",
    "RobotState",
    "Say",
    "SeatAnswer",
    "SeatRequest",
    "SensorMessage",
    "Sighting",
    "Sightings",
    "Sketch",
    "SpeedLimit",
    "Stage",
    "Stroke",
    "WorldAnswer",
    "WorldRequest",
    "Zone",
    "shortened",
]
