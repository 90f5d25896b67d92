"""The wire of ROS 2's zenoh middleware: keys, tokens of the graph, and the attachment of each message.

The forms are those of rmw_zenoh_cpp 0.6 and later (its docs/design.md, and src/detail: liveliness_utils, zenoh_utils,
attachment_helpers, qos). Humble has none of the hashes of types, and is not understood.
"""

import enum
import re
import struct
from dataclasses import dataclass
from functools import cache
from typing import Final

import xxhash

from vrg_ros.cdr import HASHES, RIHS_PREFIX


class Kind(enum.StrEnum):
    """The kinds of endpoints in the graph."""

    PUBLISHER = "MP"
    SUBSCRIBER = "MS"


@dataclass(frozen=True)
class Qos:
    """The quality of service of an endpoint, as the graph shows it: reliable, and how many messages are kept."""

    transient: bool = False
    depth: int = 10

    @property
    def chunk(self) -> str:
        """Its chunk in a token; what is left empty is the default."""
        return f":{'1' if self.transient else ''}:,{self.depth}:,:,:,,"


@dataclass(frozen=True)
class Identity:
    """A node of the graph.

    Args:
        domain: ROS_DOMAIN_ID. zid: the id of its zenoh session, hexadecimal. node: its number in that session.
        namespace: such as `/vrg`; empty for none. name: its name.
    """

    domain: int
    zid: str
    node: int
    namespace: str
    name: str

    @property
    def token(self) -> str:
        """The key of its liveliness token."""
        return f"@ros2_lv/{self.domain}/{self.zid}/{self.node}/{self.node}/NN/{self._place}"

    def endpoint(self, kind: Kind, number: int, topic: str, of: str, qos: Qos) -> str:
        """The key of the liveliness token of one of its endpoints.

        Args:
            number: the endpoint's in that session. topic: with its leading slash. of: the type of its messages.
        """
        head = f"@ros2_lv/{self.domain}/{self.zid}/{self.node}/{number}/{kind}/{self._place}"
        return f"{head}/{_mangled(topic)}/{dds_name(of)}/{HASHES[of]}/{qos.chunk}"

    @property
    def _place(self) -> str:
        return f"%/{_mangled(self.namespace) or '%'}/{self.name}"


@dataclass(frozen=True)
class Endpoint:
    """An endpoint of the graph, as its token has it.

    Args:
        kind: publisher or subscriber. node: its node, with the namespace. topic: with its leading slash. of: its type,
            such as `nav_msgs/Odometry`. hashed: the hash of that type, or what stands in its place.
    """

    kind: Kind
    node: str
    topic: str
    of: str
    hashed: str

    @property
    def trouble(self) -> str | None:
        """The reason, in words, why VRG and this endpoint cannot exchange messages; None if they can."""
        known = HASHES.get(self.of)
        if known is None or self.hashed == known:
            return None
        if not self.hashed.startswith(RIHS_PREFIX):
            return f"{self.node} runs Humble, which has no hashes of types: use Jazzy or later"
        return f"{self.node} has another definition of {self.of} than Jazzy and later have"


def endpoint_of(token: str) -> Endpoint | None:
    """The endpoint of a token; None for tokens of nodes and services, and for what is no token."""
    chunks = token.split("/")
    if len(chunks) < _CHUNKS or chunks[0] != "@ros2_lv" or chunks[5] not in (Kind.PUBLISHER, Kind.SUBSCRIBER):
        return None
    namespace, name, topic, of, hashed = (chunk.replace("%", "/") for chunk in chunks[7:12])
    return Endpoint(
        Kind(chunks[5]), f"{namespace.rstrip('/')}/{name}", topic, of.replace("::msg::dds_::", "/").rstrip("_"), hashed
    )


def graph_key(domain: int | str) -> str:
    """The key expression of all tokens of a domain, or of all domains for `*`."""
    return f"@ros2_lv/{domain}/**"


def data_key(domain: int, topic: str, of: str) -> str:
    """The key of the messages of a topic, which begins with a slash."""
    return f"{domain}/{topic.strip('/')}/{dds_name(of)}/{HASHES[of]}"


def any_type_key(domain: int, topic: str) -> str:
    """The key expression of the messages of a topic, whatever their type."""
    return f"{domain}/{topic.strip('/')}/*/*"


def dds_name(of: str) -> str:
    """The name of a type such as `nav_msgs/Odometry` as DDS has it."""
    package, name = of.split("/")
    return f"{package}::msg::dds_::{name}_"


@cache
def ros_name(name: str) -> str:
    """A name as ROS allows one: letters, digits and underscores, and no digit first."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if plain[:1].isalpha() else f"n{plain}"


_CHUNKS: Final = 13
"""The chunks of the token of an endpoint; newer distributions may add some."""
ATTACHMENT: Final = struct.Struct("<qqB16s")
GID_SIZE: Final = 16


def gid_of(token: str) -> bytes:
    """The global id of an endpoint, by the key of its token: XXH3-128, its low half first."""
    return int(xxhash.xxh3_128(token.encode()).intdigest()).to_bytes(GID_SIZE, "little")


def attachment(sequence: int, nanoseconds: int, gid: bytes) -> bytes:
    """The attachment of a message.

    Args:
        sequence: of this publisher, from 1. nanoseconds: since 1970. gid: of the publisher.
    """
    return ATTACHMENT.pack(sequence, nanoseconds, GID_SIZE, gid)


def _mangled(text: str) -> str:
    return text.replace("/", "%")
