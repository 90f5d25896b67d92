"""A harvester: it pushes the nearest pieces of its colour into the depot, or carries them if it has a gripper."""

import math

from vrg.agents import Action, Strategy, View
from vrg.agents.mover import Mover
from vrg.bus.messages import FieldObject
from vrg.geometry import wrap
from vrg.hal.actuators import Gripper
from vrg.hal.models import RobotModel
from vrg.navigation.control import scaled
from vrg.portable.scalars import atan2
from vrg.regions import Region
from vrg.types import STILL, Twist, Vector

BEHIND = 0.2
"""The distance behind a piece, besides half of both lengths, from which it is pushed, m."""
BESIDE = 0.15
"""The distance in m beside the line from a piece to the depot up to which the piece is pushed."""
PUSH = 0.6
"""The speed with which pieces are pushed, m/s."""
TURNED = 0.4
"""The direction to a piece, rad, up to which a gripper may have it."""
NEAR = 0.35
"""The distance from that place within which a robot begins to push, m."""
CLEAR = 0.55
"""How far the middle of a robot passes by a piece, m."""
KEEP_OFF = 0.9
"""How near to the other depot pieces are left where they are, m: who gets behind them is in that depot."""
INSIDE = 0.45
"""How far inside of the depot's border pieces are left, m."""


class Harvester(Strategy):
    """Each of an alliance takes the piece to which it has the shortest way; the others take the next ones."""

    games = ("harvest",)
    mode = "Harvest"

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._mover, self._last = Mover(), ""

    def act(self, view: View) -> Twist | Action:
        """Go behind the piece, and push it home; what it holds it carries there."""
        field = view.zone("field")
        depots = {zone.team: zone.region for zone in view.referee.zones if zone.kind == "depot"}
        own = depots.get(view.me.team)
        if view.me.mark is not None:
            return self._mover.go(view, (view.me.mark.x, view.me.mark.y), field) if field is not None else STILL
        if field is None or own is None:
            return STILL
        others = [region for team, region in depots.items() if team != view.me.team]
        if any(region.contains(*view.position) for region in others):  # it gives points away there
            return self._mover.go(view, field.middle, field)
        piece = self._chosen(view, own, others)
        if piece is None:
            return Action(self._mover.stay(view, own.middle), use={a.name: 0.0 for a in self.robot.actuators})
        gripper = next((actuator for actuator in self.robot.actuators if isinstance(actuator, Gripper)), None)
        if gripper is not None:
            return self._fetch(view, piece, own.middle, field, gripper)
        return self._push(view, piece, own.middle, field)

    def _chosen(self, view: View, own: Region, others: list[Region]) -> FieldObject | None:
        """The piece that this player takes; the mates before it by name choose first."""
        taken: set[str] = set()
        mates = [p for p in view.referee.players if p.team == view.me.team and p.pose is not None]
        for mate in sorted(mates, key=lambda p: p.name):
            pieces = [
                (math.floor(2.0 * math.dist((mate.pose.x, mate.pose.y), (t.x, t.y))) + 8 * (t.team != mate.team)
                 - 6 * (mate.name == self.name and t.name == self._last), t.name, t)
                for t in view.things
                if t.name not in taken and mate.pose is not None and own.distance(t.x, t.y) >= 0.0
                and not own.shrunk(INSIDE - 0.15).contains(t.x, t.y)
                and not any(region.distance(t.x, t.y) < KEEP_OFF for region in others)
            ]  # fmt: skip
            if not pieces:
                return None
            _, name, piece = min(pieces, key=lambda each: each[:2])
            if mate.name == view.me.name:
                self._last = name
                return piece
            taken.add(name)
        return None

    def _fetch(self, view: View, piece: FieldObject, home: Vector, field: Region, gripper: Gripper) -> Action:
        """Drive to a piece, and home with it. A piece that is home is not chosen any more, so it is let go there."""
        dx, dy = piece.x - view.pose.x, piece.y - view.pose.y
        distance, aim = math.hypot(dx, dy), wrap(atan2(dy, dx) - view.pose.theta)
        reach = max((math.hypot(x, y) for x, y in piece.corners), default=piece.radius) + view.robot.length / 2
        there = distance < reach + gripper.reach and abs(aim) < TURNED
        if there:
            twist = self._mover.go(view, home, field)
        elif distance > reach + CLEAR:
            twist = self._mover.go(view, self._past(view, (piece.x, piece.y)), field)
        else:
            twist = Twist(PUSH if abs(aim) < TURNED / 2 else 0.0, max(-1.5, min(1.5, 2.0 * aim)))
        return Action(twist, use={gripper.name: 1.0 if there else 0.0})

    def _push(self, view: View, piece: FieldObject, home: Vector, field: Region) -> Twist:
        """Get behind a piece, on the line from the depot, and push it along that line."""
        ux, uy = scaled((home[0] - piece.x, home[1] - piece.y), 1.0)
        dx, dy = view.pose.x - piece.x, view.pose.y - piece.y
        along, across = dx * ux + dy * uy, dx * -uy + dy * ux
        reach = max((math.hypot(x, y) for x, y in piece.corners), default=piece.radius) + view.robot.length / 2
        place: Vector = (piece.x - (reach + BEHIND) * ux, piece.y - (reach + BEHIND) * uy)
        begun = math.dist(view.position, place) < NEAR or along > -reach - 0.1
        if along < -0.5 * reach and abs(across) < (2.0 * BESIDE if begun else BESIDE):
            aim = wrap(atan2(uy, ux) - view.pose.theta) - max(-0.5, min(0.5, 2.5 * across))
            w = max(-1.5, min(1.5, 2.0 * aim))
            return Twist(PUSH if abs(aim) < 0.5 else 0.0, w)
        if along > -reach:  # beside it, or in front of it: around it first
            side, back = math.copysign(reach + BEHIND, across), reach + 2.0 * BEHIND
            place = piece.x - back * ux - side * uy, piece.y - back * uy + side * ux
        return self._mover.go(view, self._past(view, place), field)

    def _past(self, view: View, place: Vector) -> Vector:
        """The place, or one beside the first piece that is in the way."""
        x, y = view.position
        ux, uy = scaled((place[0] - x, place[1] - y), 1.0)
        first, found = math.dist((x, y), place), place
        for thing in view.things:
            dx, dy = thing.x - x, thing.y - y
            along, across = dx * ux + dy * uy, dx * -uy + dy * ux
            if 0.1 < along < first and abs(across) < CLEAR:
                first, side = along, math.copysign(1.2 * CLEAR, -across)
                found = thing.x - side * uy, thing.y + side * ux
        return found
