"""Any bytes on the bus of a match, and the keys that carry its messages."""

import contextlib
from collections.abc import Callable, Iterator, Sequence

import zenoh

from vrg.bus.configuration import client_settings
from vrg.bus.session import configuration
from vrg.bus.topics import Keys
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.touch import Touch


@contextlib.contextmanager
def raw_publisher(endpoint: str) -> Iterator[Callable[[str, bytes], None]]:
    """Publish any bytes on any key, as a broken or foreign program might."""
    session = zenoh.open(configuration(client_settings(endpoint)))
    try:
        yield session.put
    finally:
        session.close()  # type: ignore[no-untyped-call]


def concrete_keys(keys: Keys, names: Sequence[str]) -> list[str]:
    """Every key of a match that carries messages, with the robots' and players' names put in."""
    families = [
        keys.clock, keys.poses, keys.world_request, keys.referee_state, keys.referee_event, keys.official, keys.estop,
    ]  # fmt: skip
    each = [keys.drive, keys.robot_state, keys.speed_limit, keys.report, keys.manual, keys.recover, keys.placed]
    sensors = [keys.sensor(kind, name, "main").key for kind in (Ins, Odometry, Touch) for name in names]
    return [t.key for t in families] + [of(name).key for of in each for name in names] + sensors
