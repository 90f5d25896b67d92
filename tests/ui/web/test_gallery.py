"""Each viewer gets what is new to it, and the newest of that."""

import json

import pytest

from vrg.ui.web.gallery import CALLS_KEPT, Delivered, Gallery


def news(gallery: Gallery, seen: Delivered) -> tuple[list[object], Delivered]:
    text, seen = gallery.since(seen)
    return json.loads(f"[{text}]"), seen


@pytest.fixture
def gallery() -> Gallery:
    """A gallery in which nothing has been shown yet."""
    return Gallery()


def test_a_late_viewer_gets_everything_once(gallery):
    gallery.put({"ground": '"g"', "frame": '"f1"'}, ['"c1"', '"c2"'])
    found, seen = news(gallery, Delivered())
    assert found == ["g", "f1", {"t": "calls", "calls": ["c1", "c2"]}]
    assert news(gallery, seen) == ([], seen)


def test_only_what_has_changed_is_sent_again(gallery):
    gallery.put({"ground": '"g"', "frame": '"f1"'})
    _, seen = news(gallery, Delivered())
    gallery.put({"ground": '"g"', "frame": '"f2"'})
    assert news(gallery, seen)[0] == ["f2"]


def test_a_slow_viewer_gets_the_newest_frame_only_and_misses_no_call(gallery):
    gallery.put({"frame": "0"})
    _, seen = news(gallery, Delivered())
    for number in range(1, 6):
        gallery.put({"frame": str(number)}, [f'"call {number}"'])
    found, _ = news(gallery, seen)
    assert found == [5, {"t": "calls", "calls": [f"call {number}" for number in range(1, 6)]}]


def test_viewers_that_keep_up_share_one_text(gallery):
    gallery.put({"frame": '"f1"'})
    _, first = gallery.since(Delivered())
    _, second = gallery.since(Delivered())
    gallery.put({"frame": '"f2"'})
    assert gallery.since(first)[0] is gallery.since(second)[0]


def test_a_private_part_goes_to_those_alone_who_have_asked_for_it_also_if_it_is_older(gallery):
    gallery.put({"frame": '"f1"', "drawer/details/ann": '"a1"', "drawer/details/bob": '"b1"'})
    found, seen = news(gallery, Delivered())
    assert found == ["f1"]
    text, seen = gallery.since(seen, "drawer/details/ann")
    assert text == '"a1"'
    assert gallery.since(seen, "drawer/details/ann") == ("", seen)
    assert gallery.since(seen, "drawer/details/bob")[0] == '"b1"'


def test_old_calls_are_forgotten_and_nobody_gets_one_twice(gallery):
    gallery.put({}, ['"first"'])
    _, seen = news(gallery, Delivered())
    gallery.put({}, [str(number) for number in range(CALLS_KEPT + 50)])
    [late], late_seen = news(gallery, Delivered())
    assert late["calls"] == list(range(50, CALLS_KEPT + 50))
    assert news(gallery, seen)[0][0]["calls"] == list(range(50, CALLS_KEPT + 50))
    gallery.put({}, ['"last"'])
    assert news(gallery, late_seen)[0][0]["calls"] == ["last"]


def test_a_private_part_that_nobody_wants_any_more_is_forgotten_and_a_new_one_is_new(gallery):
    gallery.put({"drawer/details/ann": "old"})
    _, seen = gallery.since(Delivered(), "drawer/details/ann")
    gallery.forget({"bob"})
    assert "old" not in gallery.since(Delivered(), "drawer/details/ann")[0]
    gallery.put({"drawer/details/ann": "new"})
    assert "new" in gallery.since(seen, "drawer/details/ann")[0]
