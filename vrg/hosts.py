"""Host names and IP addresses, as people write them, as certificates have them, and as endpoints have them."""

import ipaddress

_HOST_LENGTH = 253
"""The number of characters of the longest host name (RFC 1035)."""


def is_host(text: str) -> bool:
    """True if a text is an IP address without brackets, or a host name. Names may have underscores, as some do."""
    try:
        ipaddress.ip_address(text)
    except ValueError:
        bare = text.replace("-", "").replace("_", "")
        return len(text) <= _HOST_LENGTH and text.isascii() and all(label.isalnum() for label in bare.split("."))
    return "%" not in text


def check_host(text: str) -> str:
    """Return a host name or an IP address; one of IPv6 without the brackets that people write around it.

    Raises:
        ValueError: it is neither.
    """
    host = text[1:-1] if text.startswith("[") and text.endswith("]") and ":" in text else text
    if not is_host(host):
        raise ValueError(f"expected a host name or an IP address such as 192.168.1.5, got {text!r}")
    return host


def netloc(host: str, port: int) -> str:
    """A host and a port as links and endpoints have them, such as `10.0.0.1:7447` or `[::1]:7447` (RFC 3986)."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def host_of(endpoint: str) -> str:
    """The address or name of the machine of an endpoint, such as `10.0.0.1` of `tcp/10.0.0.1:7447`."""
    return endpoint.partition("/")[2].rpartition(":")[0].strip("[]")


def port_of(endpoint: str) -> str:
    """The port of an endpoint, such as `7447` of `tcp/10.0.0.1:7447`."""
    return endpoint.rpartition(":")[2].split("?")[0].split("#")[0]
