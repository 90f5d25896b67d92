"""Sensors: the spec of each in a robot model, the message of each on the bus, and the sample that a player is given.

A kind of sensor is one module here with two classes: its *spec*, which stands in a robot model, and its *message*,
which travels on the bus. The world's simulation of it is one module in vrg/hal/sim/sensors, which the spec names. A
package outside VRG adds a kind by an entry point of the group `vrg.sensors` whose object is the class of the spec.
"""

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import SensorSpec
from vrg.registry import Registry, subclass_of

SENSORS: Registry[type[SensorSpec]] = Registry(
    "sensor",
    "vrg.sensors",
    {
        "battery": "vrg.hal.sensors.battery:BatterySpec",
        "camera": "vrg.hal.sensors.camera:CameraSpec",
        "encoders": "vrg.hal.sensors.encoders:EncodersSpec",
        "gps": "vrg.hal.sensors.gps:GpsSpec",
        "ins": "vrg.hal.sensors.ins:InsSpec",
        "altimeter": "vrg.hal.sensors.downward:AltimeterSpec",
        "overview": "vrg.hal.sensors.downward:OverviewSpec",
        "laser": "vrg.hal.sensors.laser:LaserSpec",
        "odometry": "vrg.hal.sensors.odometry:OdometrySpec",
        "sonar": "vrg.hal.sensors.sonar:SonarSpec",
        "touch": "vrg.hal.sensors.touch:TouchSpec",
    },
    subclass_of(SensorSpec),
)
"""The spec's class of every kind of sensor, by the word that stands for the kind in keys."""


def message_class(kind: str) -> type[SensorMessage] | None:
    """The message class of a kind of sensor, or None for a kind that is not installed on this machine."""
    spec = SENSORS.find(kind) if kind in SENSORS else None
    return None if spec is None else spec.message
