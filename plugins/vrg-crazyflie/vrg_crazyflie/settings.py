"""The settings of Crazyflies in a match file: the table [backends.crazyflie]."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, Field

from vrg.errors import ConfigError
from vrg.hal.models import RobotModel
from vrg.hal.settings import BackendSettings
from vrg.tables import Table

_URI: Final = re.compile(
    r"radio://(\d+|[0-9A-Fa-f]{10})/(\d\d?|1[01]\d|12[0-5])/(250K|1M|2M)(/[0-9A-Fa-f]{1,10})?(\?.*)?"
    r"|usb://\d+|(udp|tcp)://[^/:]+:\d+|serial://[^/]+|vrg://[\w.-]+"
)


def uri_of(value: str) -> str:
    """The address of a Crazyflie, in cflib's words.

    Raises:
        ValueError: it is not one.
    """
    if _URI.fullmatch(value):
        return value
    radio = "radio://0/80/2M/E7E7E7E701 with a channel of 0 to 125 and a rate of 250K, 1M or 2M"
    raise ValueError(f"expected usb://0, udp://HOST:PORT, or an address such as {radio}, got {value!r}")


class CrazyflieRobot(Table):
    """One robot: [backends.crazyflie.robots.<name>].

    Args:
        uri: its address, such as `radio://0/80/2M/E7E7E7E701`; an emulated one needs none.
        height: the height above the ground to which it takes off, m.
        ceiling: the greatest height to which commands make it climb, m; None if it keeps its height.
        pose: `odometry` if its estimator has no frame that others know, as with a Flow deck: its way since VRG first
            heard it counts. `map` if the estimator's frame is that of the map, as with Lighthouse or motion capture.
        battery_low: the voltage under load below which it lands, V.
    """

    uri: Annotated[str, AfterValidator(uri_of)] = ""
    height: float = Field(0.4, ge=0.2, le=2.0)
    ceiling: float | None = Field(None, ge=0.2, le=2.0)
    pose: Literal["odometry", "map"] = "odometry"
    battery_low: float = Field(3.3, ge=3.0, le=3.8)


class CrazyflieSettings(BackendSettings):
    """The table [backends.crazyflie].

    Args:
        emulate: emulate these Crazyflies, each within its player's process.
        robots: the settings by the robot's name. Robots whose backend is another one are left alone.
    """

    emulate: bool = False
    robots: dict[str, CrazyflieRobot] = Field(default_factory=dict)

    def robot(self, name: str) -> CrazyflieRobot:
        """The settings of a robot. An emulated one needs no table, and has an address of its own.

        Raises:
            ConfigError: it has no table.
        """
        found = self.robots.get(name)
        if self.emulate:
            uri = "vrg://" + re.sub(r"[^\w.-]", "_", name)
            return (found or CrazyflieRobot.model_validate({})).model_copy(update={"uri": uri})
        if found is None or not found.uri:
            raise ConfigError(_no_table(name))
        return found

    def problems(self, robots: Mapping[str, RobotModel], base: Path) -> list[str]:
        """Low ceilings, robots without an address, two of one address, and models that cannot fly sideways."""
        found = [
            f'{name}: expected a model that moves in any direction, such as model = "Crazyflie", got {model.name}'
            for name, model in robots.items()
            if not model.drivetrain.holonomic
        ]
        found += [
            f"robots.{name}: expected a ceiling above its height, {robot.height:g} m, got {robot.ceiling:g}: "
            "raise it, or leave it out"
            for name, robot in self.robots.items()
            if robot.ceiling is not None and robot.ceiling <= robot.height
        ]
        if self.emulate:
            return found
        owners: dict[str, str] = {}
        for name in robots:
            robot = self.robots.get(name)
            if robot is None or not robot.uri:
                found.append(_no_table(name))
                continue
            if (owner := owners.setdefault(_identity(robot.uri), name)) != name:
                found.append(f"robots.{name}: {robot.uri} is the address of {owner}, too: change it by cfclient")
            dongle = "/".join(robot.uri.split("/")[:3])
            if dongle.startswith("radio:") and (owner := owners.setdefault(dongle, name)) != name:
                ask = "plug in another one, and write radio://1/ or its serial number"
                found.append(f"robots.{name}: it is a process of its own, and cannot share {owner}'s Crazyradio: {ask}")
        return found

    def unverified(self, robots: Sequence[str]) -> list[str]:
        """What nobody has tried, and what stops it if this computer dies."""
        if self.emulate:
            return []
        return [
            f"{name}: if this computer or the radio fails, its firmware levels it after 0.5 s, and cuts its motors "
            "after 2 s, so that it falls from its height: fly over a soft floor, in a net (the README of "
            "vrg-crazyflie)"
            for name in robots
        ]

    def missing_here(self, robots: Sequence[str]) -> list[str]:
        """A Crazyradio, for those with an address of a radio."""
        radios = [name for name in robots if not self.emulate and self.robots[name].uri.startswith("radio:")]
        if not radios:
            return []
        try:
            from cflib.drivers.crazyradio import get_serials  # noqa: PLC0415 - a match file is checked without

            why = "" if get_serials() else "no Crazyradio is plugged in, or it may not be used"
        except Exception as error:  # of whatever USB library cflib has found
            why = f"USB cannot be used: {error}"
        return [f"{' and '.join(radios)}: {why}: see the udev rule in the README of vrg-crazyflie"] if why else []


def _identity(uri: str) -> str:
    """What is the same for two addresses of one Crazyflie: whatever dongle and options they name."""
    plain = uri.partition("?")[0]
    if not plain.startswith("radio://"):
        return plain
    _, channel, rate, *address = plain.removeprefix("radio://").split("/")
    return "/".join((channel, rate, (address or ["E7E7E7E7E7"])[0].upper().rjust(10, "0")))


def _no_table(name: str) -> str:
    return f"expected [backends.crazyflie.robots.{name}] with a uri such as radio://0/80/2M/E7E7E7E701, found none"
