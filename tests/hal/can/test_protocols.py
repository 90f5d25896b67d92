"""The protocols that come with VRG keep the contract of protocols."""

import pytest

from vrg.errors import ConfigError
from vrg.hal.can.cia402.units import Cia402Options
from vrg.hal.can.protocols import PROTOCOLS, Protocol
from vrg.hal.can.vesc.axis import VescOptions
from vrg.testing.protocol import ProtocolContract


class TestOdrive(ProtocolContract):
    protocol = PROTOCOLS.get("odrive")
    nodes = (0, 7, 62)
    impossible_nodes = (-1, 63, 100)


class TestCia402(ProtocolContract):
    protocol = PROTOCOLS.get("cia402")
    nodes = (1, 64, 127)
    impossible_nodes = (-1, 0, 128)


class TestCia402ThatDoesNotTellItsUnits(ProtocolContract):
    protocol = PROTOCOLS.get("cia402")
    options = Cia402Options(counts=4096, velocity_unit="0.1/min")
    nodes = (1, 64, 127)
    impossible_nodes = (-1, 0, 128)


class TestMoteus(ProtocolContract):
    protocol = PROTOCOLS.get("moteus")
    nodes = (1, 7, 8, 126)
    impossible_nodes = (-1, 0, 127)


class TestVesc(ProtocolContract):
    protocol = PROTOCOLS.get("vesc")
    options = VescOptions(pole_pairs=7)
    nodes = (0, 42, 223)
    impossible_nodes = (-1, 224, 254, 255)


@pytest.mark.parametrize("name", ["odrive", "cia402", "moteus", "vesc"])
def test_a_protocol_has_the_name_that_it_is_found_by(name: str) -> None:
    assert PROTOCOLS.get(name).name == name


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
