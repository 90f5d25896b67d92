"""A view on its way to a strategy that decides in a process of its own.

What all players of an instant are shown is encoded once for all of them, as MessagePack; the rest is pickled. What is
always the same is sent once.
"""

import pickle
from collections.abc import Mapping
from typing import Any

import msgspec

from vrg.agents.strategy import View
from vrg.bus.messages import RefereeState
from vrg.hal.models import RobotModel
from vrg.shared import shared
from vrg.types import Vector

_encoder = msgspec.msgpack.Encoder()
_state_decoder = msgspec.msgpack.Decoder(RefereeState)
_velocities_decoder = msgspec.msgpack.Decoder(dict[str, Vector])
_SAME = ("robot", "obstacles")
"""The fields that are always the same: the longest ones."""


def packed(view: View, known: RobotModel | None) -> bytes:
    """A view as it is sent.

    Args:
        known: the robot in the view that was sent before; None for the first one.
    """
    fields: dict[str, Any] = {name: getattr(view, name) for name in View.__struct_fields__}
    if view.robot is known:
        for name in _SAME:
            del fields[name]
    players = view.referee.players
    number = next((number for number, player in enumerate(players) if player is view.me), None)
    if number is not None:
        fields["me"] = number
    fields["referee"], fields["velocities"] = _state(view.referee), _velocities(view.velocities)
    return pickle.dumps(fields, pickle.HIGHEST_PROTOCOL)


def unpacked(data: bytes, before: View | None) -> View:
    """The view that was sent.

    Args:
        before: the one that was sent before; None for the first one.
    """
    fields: dict[str, Any] = pickle.loads(data)
    for name in _SAME if before is not None else ():
        fields.setdefault(name, getattr(before, name))
    fields["referee"] = _state_decoder.decode(fields["referee"])
    fields["velocities"] = _velocities_decoder.decode(fields["velocities"])
    if isinstance(fields["me"], int):
        fields["me"] = fields["referee"].players[fields["me"]]
    return View(**fields)


@shared
def _state(state: RefereeState) -> bytes:
    return _encoder.encode(state)


@shared
def _velocities(velocities: Mapping[str, Vector]) -> bytes:
    return _encoder.encode(velocities)
