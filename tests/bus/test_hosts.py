"""Host names and IP addresses that people write."""

import pytest

from vrg.hosts import check_host, is_host


@pytest.mark.parametrize(
    ("written", "host"),
    [
        ("10.0.0.5", "10.0.0.5"),
        ("arena.local", "arena.local"),
        ("lab_2", "lab_2"),
        ("2001:db8::1", "2001:db8::1"),
        ("[2001:db8::1]", "2001:db8::1"),
    ],
)
def test_a_host_is_read_as_people_write_it(written: str, host: str) -> None:
    assert check_host(written) == host


@pytest.mark.parametrize(
    "text",
    ["", "two words", "a/b", "ł.pl", "tcp/1.2.3.4:7447", "a..b", "*", "[10.0.0.5]", "fe80::1%eth0", "a" * 254],
)
def test_what_is_no_host_is_refused(text: str) -> None:
    assert not is_host(text)
    with pytest.raises(ValueError, match="expected a host name or an IP address"):
        check_host(text)
