"""The protocol that comes with VRG keeps the contract of protocols."""

import pytest

from vrg.errors import ConfigError
from vrg.hal.can.protocols import PROTOCOLS, Protocol
from vrg.testing.protocol import ProtocolContract


class TestOdrive(ProtocolContract):
    protocol = PROTOCOLS.get("odrive")
    nodes = (0, 7, 62)
    impossible_nodes = (-1, 63, 100)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("nowhere:Axis", "protocol p: cannot import nowhere:Axis"),
        ("vrg.hal.can.axis:Nothing", "protocol p: cannot import vrg.hal.can.axis:Nothing"),
        ("vrg.hal.can.frame:Frame", "protocol p: vrg.hal.can.frame:Frame: expected a subclass of Axis"),
    ],
)
def test_a_protocol_whose_class_cannot_be_used_is_said(target: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        assert Protocol("p", axis=target, drive=target, listener=target).axis_type
