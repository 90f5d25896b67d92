"""The protocols that come with VRG keep the contract of protocols."""

import pytest

from vrg.errors import ConfigError
from vrg.hal.can.protocols import PROTOCOLS, Protocol
from vrg.testing.protocol import ProtocolContract


class TestOdrive(ProtocolContract):
    protocol = PROTOCOLS.get("odrive")
    nodes = (0, 7, 62)
    impossible_nodes = (-1, 63, 100)


class TestCia402(ProtocolContract):
    protocol = PROTOCOLS.get("cia402")
    nodes = (1, 64, 127)
    impossible_nodes = (-1, 0, 128)


@pytest.mark.parametrize("name", ["odrive", "cia402"])
def test_a_protocol_has_the_name_that_it_is_found_by(name: str) -> None:
    assert PROTOCOLS.get(name).name == name


def test_an_unknown_protocol_is_said_with_a_guess() -> None:
    with pytest.raises(ConfigError, match=r"protocol: expected one of cia402, odrive, got 'o-drive', did you mean"):
        PROTOCOLS.get("o-drive")


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
