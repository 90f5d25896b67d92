"""The details of a match of real processes with seats."""

import re
from collections.abc import Callable

import pytest

from vrg.testing.processes.match import MINNOWS, LiveMatch, long_match
from vrg.testing.views.browser import Visitor, chromium
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system


def test_an_official_sees_streams_and_processes(start: Callable[..., LiveMatch]) -> None:
    match = start(long_match("looked-into"), options=["--developer"], seats=True)
    links: list[str] = []

    def printed() -> bool:
        links[:] = re.findall(r"official +(http://\S+&details)", match.output.read_text())
        return bool(links)

    wait_until(printed, "the launcher to print the official's link")
    with chromium() as browser:
        official = Visitor(browser, links[0], (800, 500))
        official.page.click("[data-tab=streams]")
        for key in (f"player/{MINNOWS[0]}/report", "pulse/coordinator/referee"):
            official.page.fill("#filter", key)
            official.wait_text("#table td", key)
        official.page.click("[data-tab=processes]")
        official.wait_text("#table tr", "running")
        assert official.errors == []
        official.close()
