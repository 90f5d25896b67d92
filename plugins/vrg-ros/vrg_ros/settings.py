"""The settings of robots that run ROS 2 in a match file: the table [backends.ros]."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Final

from pydantic import AfterValidator, Field

from vrg.errors import BusError, RobotError
from vrg.hal.models import RobotModel
from vrg.hal.settings import BackendSettings
from vrg.tables import Table


def router_of(value: str) -> str:
    """The endpoint of a router that ROS nodes can connect to.

    Raises:
        ValueError: it is not one.
    """
    host, _, port = value.removeprefix("tcp/").rpartition(":")
    if not (value.startswith("tcp/") and host and port.isdecimal() and 0 < int(port) < 65536):
        raise ValueError(f"expected a router such as tcp/192.168.1.20:7447, got {value!r}")
    return value.replace("/localhost:", "/127.0.0.1:")


Endpoint = Annotated[str, AfterValidator(router_of)]
_PATIENCE: Final = 3.0
"""The real time in s to wait for a router."""
_NAME: Final = r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*"
TopicName = Annotated[str, Field(pattern=f"^{_NAME}$")]
MaybeTopicName = Annotated[str, Field(pattern=f"^({_NAME})?$")]
Domain = Annotated[int, Field(ge=0, le=232)]


class RosRobot(Table):
    """One robot: [backends.ros.robots.<name>].

    Args:
        namespace: that of its topics, such as `/tb1`; empty for none. frame: the frame of its body, which its odometry
            must name as `child_frame_id`; empty takes any.
        cmd_vel, odom, scan, battery: its topics, in its namespace, or anywhere with a leading slash. An empty `scan`
            or `battery` is one that it lacks: the world simulates such a laser.
        scan_yaw: the heading of its laser's frame on the robot, degrees.
        use_sim_time: it is simulated, as by Gazebo, and stamps by a clock that may stop or fall behind real time.
        router, domain: for a robot with a router or a domain of its own, in place of those of [backends.ros].
    """

    namespace: MaybeTopicName = ""
    frame: str = ""
    cmd_vel: TopicName = "cmd_vel"
    odom: TopicName = "odom"
    scan: MaybeTopicName = "scan"
    battery: MaybeTopicName = "battery_state"
    scan_yaw: float = Field(0.0, ge=-360.0, le=360.0)
    use_sim_time: bool = False
    router: Endpoint | None = None
    domain: Domain | None = None

    def topic(self, name: str) -> str:
        """The full name of a topic, with its leading slash."""
        if name.startswith("/"):
            return name
        return f"{self.place}/{name}"

    @property
    def place(self) -> str:
        """The namespace with its leading slash; empty for none."""
        plain = self.namespace.strip("/")
        return f"/{plain}" if plain else ""


class RosSettings(BackendSettings):
    """The table [backends.ros].

    Args:
        router: the zenoh router of the robots' ROS nodes, such as rmw_zenohd's. domain: ROS_DOMAIN_ID.
        robots: the topics by the robot's name. Robots whose backend is another one are left alone.
    """

    router: Endpoint = "tcp/127.0.0.1:7447"
    domain: Domain = 0
    robots: dict[str, RosRobot] = Field(default_factory=dict)

    def reached(self, name: str) -> tuple[str, int]:
        """The router and the domain of a robot."""
        robot = self.robots[name]
        return robot.router or self.router, self.domain if robot.domain is None else robot.domain

    def problems(self, robots: Mapping[str, RobotModel], base: Path) -> list[str]:
        """Robots without a table, and two that obey the same topic."""
        found = [
            f"expected a table [backends.ros.robots.{name}] with its topics, found none"
            for name in robots
            if name not in self.robots
        ]
        owners: dict[tuple[str, int, str], str] = {}
        for name in robots:
            if (robot := self.robots.get(name)) is not None:
                topic = robot.topic(robot.cmd_vel)
                if (owner := owners.setdefault((*self.reached(name), topic), name)) != name:
                    found.append(f"robots.{name}: {owner} obeys {topic}, too: give each a `namespace`")
        return found

    def unverified(self, robots: Sequence[str]) -> list[str]:
        """Their own watchdogs, which no message proves."""
        return [
            f"{name}: its own driver must stop it when {self.robots[name].topic(self.robots[name].cmd_vel)} ceases, "
            "as nothing else does if this computer or the network fails: lift its wheels and try it "
            "(the README of vrg-ros)"
            for name in robots
        ]

    def missing_here(self, robots: Sequence[str]) -> list[str]:
        """Routers that do not answer, and robots that are not in the graph of ROS 2."""
        from vrg.bus.session import open_session  # noqa: PLC0415 - a match file is checked without
        from vrg_ros.meeting import commanders, graph_of, met, no_router, node_name  # noqa: PLC0415

        found = []
        for name in robots:
            (router, domain), robot = self.reached(name), self.robots[name]
            try:
                with open_session(router, patience=_PATIENCE) as session:
                    graph = graph_of(session, domain)
                met(graph, robot.topic(robot.cmd_vel), robot.topic(robot.odom))
                own = f"{robot.place}/{node_name(name)}"  # the driver of a match that runs already
                if others := [node for node in commanders(graph, robot.topic(robot.cmd_vel)) if node != own]:
                    found.append(f"{name}: it is commanded by {' and '.join(others)}: stop that before the match")
            except BusError:
                found.append(f"{name}: {no_router(router)}")
            except RobotError as error:
                found.append(f"{name}: {error}")
        return found

    def endpoints(self, robots: Sequence[str]) -> list[str]:
        """The routers."""
        return [self.reached(name)[0] for name in robots]
