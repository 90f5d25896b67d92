"""Every message that travels on the bus, one frozen struct each. The messages of sensors are in vrg.hal.sensors.

Numbers are bounded, so NaN and infinity never pass. A value that is not known is None, never 0.0.
The version of a message is raised whenever a field changes.
"""

from vrg.bus.messages.base import REASON_LENGTH, TEXT_LENGTH, Message, SensorMessage, shortened
from vrg.bus.messages.match import (
    BY_OFFICIAL,
    DISQUALIFIED,
    EMERGENCY_STOP,
    FAILED,
    LARGE_ZONES,
    TIME_LIMIT,
    Auction,
    Call,
    Estop,
    EstopRelease,
    FieldObject,
    Official,
    OfficialAction,
    PlayerStatus,
    RefereeState,
    Sight,
    Stage,
    Zone,
)
from vrg.bus.messages.player import (
    CORRELATION,
    SAY_LIMIT,
    SIGHTINGS_LIMIT,
    SKETCH_LIMIT,
    VARIANCE_LIMIT,
    Bid,
    Cost,
    Covariance,
    LinkCount,
    Links,
    Manual,
    Pulse,
    Report,
    Say,
    Sighting,
    Sightings,
    Sketch,
    Stroke,
    TeamOrder,
    Variance,
)
from vrg.bus.messages.process import Processes, ProcessState, ProcessStatus, SeatAnswer, SeatRequest
from vrg.bus.messages.robot import (
    LOST,
    CameraRequest,
    Drive,
    Fix,
    Fixes,
    MeasuredPose,
    Motion,
    OwnPlace,
    Placed,
    Recover,
    RobotState,
    SpeedLimit,
)
from vrg.bus.messages.world import AT_REST, Body, Clock, Poses, Thing, WorldAnswer, WorldRequest, at_rest
