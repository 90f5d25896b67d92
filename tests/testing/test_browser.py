"""The browser of tests: they share one, it keeps no page, and another event loop runs where nobody has it."""

import asyncio

from vrg.testing.views.browser import Visitor, chromium

PAGE = "data:text/html,<body>hello"


def test_all_who_want_a_browser_share_it_and_leave_nothing_in_it() -> None:
    with chromium() as first:
        assert Visitor(first, PAGE).text("body") == "hello"
        with chromium() as again:
            Visitor(again, PAGE)
            assert len(first.contexts) == 2
        assert len(first.contexts) == 1, "what was there before stays"
    with chromium() as later:
        assert later is first
        assert not later.contexts


def test_another_event_loop_runs_where_nobody_has_a_browser() -> None:
    for _ in range(2):
        with chromium() as browser:
            Visitor(browser, PAGE)
            assert asyncio.get_running_loop()
        asyncio.run(asyncio.sleep(0.0))
