"""The limited view: a team sees opponents only within a sensing range of one of its own. Pure functions.

It is an option of a match, as in the first RoboFlag at Cornell. The referee then publishes no poses to everybody, but
tells each team those that it sees. Windows and recordings take poses from the world, and the
rules judge by them too. Calls are public, with the places where they happened.
"""

import math
from collections.abc import Sequence

from msgspec import structs

from vrg.bus.messages import PlayerStatus, RefereeState, Sight
from vrg.types import Pose


def seen_by(team: str, players: Sequence[PlayerStatus], reach: float) -> dict[str, Pose]:
    """The poses that a team sees: its own, and those within `reach` m of the centre of one of its own robots."""
    poses = {player.name: player.pose for player in players if player.pose is not None}
    own = [poses[player.name] for player in players if player.team == team and player.name in poses]
    friends = {player.name for player in players if player.team == team}
    return {
        name: pose
        for name, pose in poses.items()
        if name in friends or any(math.hypot(pose.x - eye.x, pose.y - eye.y) <= reach for eye in own)
    }


def views(state: RefereeState, reach: float) -> tuple[RefereeState, dict[str, Sight]]:
    """The state that all players receive, and the sight of each team besides.

    Args:
        reach: how far a team sees from each of its robots, m.

    Returns:
        the state as `hidden` makes it, and the sight of each team.
    """
    teams = sorted({player.team for player in state.players})
    return hidden(state), {team: Sight(poses=seen_by(team, state.players, reach)) for team in teams}


def hidden(state: RefereeState) -> RefereeState:
    """The state without the players' poses, and without their bids, which would betray them."""
    players = tuple(structs.replace(player, pose=None) for player in state.players)
    auctions = tuple(structs.replace(auction, bids={}) for auction in state.auctions)
    return structs.replace(state, players=players, auctions=auctions)
