"""The configuration of zenoh for every process of a match, as plain data: a router's serves a stock `zenohd` too."""

import os
from collections.abc import Sequence
from typing import Any

from vrg.errors import BusError
from vrg.seats.credentials import Credentials

LEASE_MS = 1000
"""The time in ms after which a frozen process is noticed. The default of zenoh is ten times as long."""
BLOCKED_US = 100_000
"""The time in us that an event or a state waits for a link that takes nothing in. Then the link is closed, because
meanwhile the router reads nothing from the publisher. By default it waits 5 s, and the publisher loses its own link."""
BATCH_SIZE = 8192
"""The number of bytes that are sent at a time. A link that takes longer than LEASE_MS for them counts as lost."""
BATCHES = 16
"""The number of batches that wait for a link in each class of messages. Messages of which only the newest counts have
fewer at the router, so that they are not old after a slow link."""
FEW_BATCHES = 8
BUFFER_SIZE = 65_536
"""The number of bytes that a router has the operating system keep for a link, for the same reason. By default it keeps
up to 4 MB, which a link of 60 kB/s takes a minute for. With less, pictures of cameras do not get through loopback."""
DROP_US, FRAGMENTS_US = 5_000, 200_000
"""The time in us that a message waits for room before it is dropped, if only the newest counts, and the longest such
time for one in many parts: a picture has a thousand, and must not be lost because a machine is busy."""
PENDING = 5000
"""The number of connections that a router takes, and of those whose other end has not identified itself yet."""
MAX_MESSAGE_SIZE = 16_000_000
"""The number of bytes of the longest message that is taken in. A picture of a camera has at most half as many. By
default a process that is admitted could fill the memory of all others with messages of a gigabyte."""
_SECURE = "tls/"


def client_settings(
    endpoint: str, credentials: Credentials | None = None, *, shared_memory: bool = True
) -> dict[str, Any]:
    """The configuration of a client of the router at `endpoint`.

    Args:
        shared_memory: False for a process that may make none, because it is sealed.
    """
    settings = _settings("client", {"connect": _connect([endpoint])}, credentials)
    if not shared_memory:
        settings["transport"]["shared_memory"] = {"enabled": False}
    return settings


def router_settings(
    endpoints: Sequence[str],
    credentials: Credentials | None = None,
    access: dict[str, Any] | None = None,
    *,
    upstream: str | None = None,
) -> dict[str, Any]:
    """The configuration of a router that listens at some endpoints.

    Args:
        credentials: those of the seat `router`; None lets everybody in.
        access: who may do what, as `vrg.bus.access.rules` makes it; None lets everybody do everything.
        upstream: the endpoint of another router to be linked with.
    """
    others = [] if upstream is None else [upstream]
    settings = _settings("router", {"listen": {"endpoints": [*endpoints]}, "connect": _connect(others)}, credentials)
    if credentials is None:
        # Clients need no gossip. Peers, which ROS nodes are, find one another only by that of their router.
        autoconnect = {"router": [], "peer": ["router", "peer"]}
        settings["scouting"]["gossip"] = {"enabled": True, "multihop": False, "autoconnect": autoconnect}
    # One process that opens many connections and never identifies itself must not keep the others out.
    settings["transport"]["unicast"] = {"accept_pending": PENDING, "max_sessions": PENDING}
    if access is not None:
        settings["access_control"] = access
    return settings


def check_endpoint(endpoint: str, credentials: Credentials | None = None) -> None:
    """Make sure that an endpoint can be used.

    Raises:
        BusError: it is no endpoint, or it is encrypted and there are no keys for it, or the other way round.
    """
    if "/" not in endpoint:
        raise BusError(f"expected an endpoint such as tcp/127.0.0.1:7447, got {endpoint!r}")
    secure = endpoint.startswith(_SECURE)
    if secure and credentials is None:
        raise BusError(
            f"the router at {endpoint} admits only seats with keys: name the folder of the keys with --keys, or in "
            "the variable VRG_KEYS"
        )
    if not secure and credentials is not None:
        raise BusError(
            f"expected an endpoint that begins with {_SECURE}, because keys were given, got {endpoint!r}: without "
            "encryption no process can prove its identity"
        )


def _connect(endpoints: list[str]) -> dict[str, Any]:
    retry = {"period_init_ms": 50, "period_max_ms": 200, "period_increase_factor": 1.5}
    return {"retry": retry, **({"endpoints": endpoints} if endpoints else {})}


def _settings(mode: str, ends: dict[str, Any], credentials: Credentials | None) -> dict[str, Any]:
    """Explicit endpoints, no scouting, and a short lease."""
    low = FEW_BATCHES if mode == "router" else BATCHES
    queue = {
        "size": {"control": BATCHES, "data": BATCHES, "data_low": low},
        "congestion_control": {
            "block": {"wait_before_close": BLOCKED_US},
            "drop": {"wait_before_drop": DROP_US, "max_wait_before_drop_fragments": FRAGMENTS_US},
        },
    }
    link: dict[str, Any] = {
        "tx": {"lease": LEASE_MS, "keep_alive": 4, "batch_size": BATCH_SIZE, "queue": queue},
        "rx": {"max_message_size": MAX_MESSAGE_SIZE},
    }
    if mode == "router":
        link["tcp"] = {"so_sndbuf": BUFFER_SIZE}
    if credentials is not None:
        # A router may connect to another one.
        roles = ("listen", "connect") if mode == "router" else ("connect",)
        link["tls"] = {
            "root_ca_certificate": os.path.abspath(credentials.authority),
            **{f"{role}_certificate": os.path.abspath(credentials.certificate) for role in roles},
            **{f"{role}_private_key": os.path.abspath(credentials.private_key) for role in roles},
            "enable_mtls": True,
            "verify_name_on_connect": True,
            **link.pop("tcp", {}),
        }
        link["protocols"] = ["tls"]
    return {
        "mode": mode,
        # A router waits for the delay before it opens, also where it looks for nobody: see
        # findings/zenoh-router-waits-to-scout.sh.
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
        "transport": {"link": link},
        **ends,
    }
