"""Who may do what on the page, by the token of the link."""

from dataclasses import replace

import pytest

from vrg.ui.web.admission import OFFICIAL, VIEWER, VisitorKind, VisitorRole, admission, read_admission
from vrg.ui.web.lobby import AT_ONCE, PER_SECOND, Admitted, Allowance, Lobby, Refused
from vrg.ui.web.requests import DriveRequest, Hello, PageButton, Pressed, read_request, refusal

PAGE = admission("127.0.0.1", 8080, ["ann", "bob"])
ANN = VisitorRole(VisitorKind.SEAT, "ann")


def test_each_token_admits_to_its_own_role():
    assert PAGE.role_of("") == VIEWER
    assert PAGE.role_of(PAGE.official) == OFFICIAL
    assert PAGE.role_of(PAGE.seats["ann"]) == ANN
    assert PAGE.role_of("guessed") is None
    assert PAGE.role_of("ä") is None
    assert len({PAGE.official, *PAGE.seats.values()}) == 3


def test_a_page_without_deciding_has_no_tokens_and_an_empty_one_admits_to_nothing_more():
    watching = admission("127.0.0.1", 8080, ["ann"], deciding=False)
    assert watching.role_of("") == VIEWER
    assert [role for role, _ in watching.links("127.0.0.1")] == [VIEWER]


def test_links_carry_the_token_in_the_fragment_which_is_sent_to_no_server():
    links = dict(PAGE.links("::1"))
    assert links[VIEWER] == "http://[::1]:8080/"
    assert links[ANN] == f"http://[::1]:8080/#{PAGE.seats['ann']}"


def test_a_page_with_a_certificate_has_links_of_https_and_keeps_it_with_its_tokens():
    page = replace(PAGE, certificate="C", private_key="K")
    assert all(link.startswith("https://") for _, link in page.links("10.0.0.1"))
    assert admission("0.0.0.0", 9000, ["ann", "bob"], known=page) == replace(page, host="0.0.0.0", port=9000)
    assert admission("0.0.0.0", 9000, [], deciding=False, known=page).certificate == "C"
    assert "K" not in repr(page).replace("VisitorKind", "")


def test_what_is_printed_of_it_by_accident_has_no_token():
    assert PAGE.official not in repr(PAGE)
    assert PAGE.seats["ann"] not in repr(PAGE)


def test_it_travels_in_one_line():
    line = PAGE.encoded()
    assert "\n" not in line
    assert read_admission(line) == PAGE
    with pytest.raises(ValueError, match="expected the tokens") as error:
        read_admission(line[:-5])
    assert PAGE.official not in str(error.value)


def test_an_official_decides_but_does_not_drive_and_a_driver_may_also_stop_everything():
    assert all(not refusal(OFFICIAL, Pressed(what=what)) for what in PageButton)
    assert refusal(OFFICIAL, DriveRequest(forward=1.0, turn=0.0))
    assert not refusal(ANN, DriveRequest(forward=1.0, turn=0.0))
    assert [what for what in PageButton if not refusal(ANN, Pressed(what=what))] == [PageButton.ESTOP]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", "expected a request in JSON"),
        ("[]", "not understood"),
        ('{"t":"fly"}', "not understood"),
        ('{"t":"drive","forward":2,"turn":0}', r"<= 1.0.*forward"),
        ('{"t":"drive","forward":NaN,"turn":0}', "expected a request in JSON"),
        ('{"t":"drive","forward":0}', "turn"),
        ('{"t":"act","what":"win"}', "not understood"),
        ('{"t":"hello","token":"' + "x" * 65 + '"}', "token"),
        ('{"t":"ack","count":-1}', "count"),
        ('{"t":"give_back","player":"bob"}', "player"),
    ],
)
def test_a_bad_request_is_told_in_words(text, why):
    with pytest.raises(ValueError, match=why):
        read_request(text)


@pytest.fixture
def lobby() -> Lobby:
    """Where guests of the page are let in."""
    return Lobby(PAGE)


class TestLobby:
    def test_a_seat_can_be_taken_over_on_purpose_and_the_one_before_may_watch(self, lobby):
        lobby.admit(1, Hello(token=PAGE.seats["ann"], tab="a"))
        assert lobby.admit(2, Hello(token=PAGE.seats["ann"], tab="b", takeover=True)) == Admitted(ANN, displaced=1)
        assert lobby.roles == {1: VIEWER, 2: ANN}
        assert lobby.leave(1) == VIEWER
        assert lobby.holder(ANN) == 2

    def test_a_page_that_comes_back_has_its_seat_again_though_its_old_connection_is_not_gone(self, lobby):
        lobby.admit(1, Hello(token=PAGE.seats["ann"], tab="a"))
        assert lobby.admit(2, Hello(token=PAGE.seats["ann"], tab="a")) == Admitted(ANN, displaced=1)

    def test_pages_without_a_word_of_their_own_do_not_count_as_the_same(self, lobby):
        lobby.admit(1, Hello(token=PAGE.seats["ann"]))
        assert isinstance(lobby.admit(2, Hello(token=PAGE.seats["ann"])), Refused)

    def test_a_seat_that_was_left_is_free(self, lobby):
        lobby.admit(1, Hello(token=PAGE.seats["ann"]))
        assert lobby.leave(1) == ANN
        assert lobby.leave(1) is None
        assert lobby.admit(2, Hello(token=PAGE.seats["ann"])) == Admitted(ANN)

    def test_viewers_are_bounded_but_never_keep_the_official_or_a_driver_out(self):
        lobby = Lobby(PAGE, limit=2)
        assert lobby.admit(1, Hello()) == lobby.admit(2, Hello()) == Admitted(VIEWER)
        full = lobby.admit(3, Hello())
        assert isinstance(full, Refused)
        assert full.reason == "full"
        assert lobby.admit(4, Hello(token=PAGE.official)) == Admitted(OFFICIAL)
        assert lobby.admit(5, Hello(token=PAGE.seats["ann"])) == Admitted(ANN)

    def test_of_too_many_viewers_the_newest_of_the_largest_crowd_must_go(self):
        lobby = Lobby(PAGE, limit=3)
        for guest, address in enumerate(("a", "b", "b"), start=1):
            assert lobby.admit(guest, Hello(), address) == Admitted(VIEWER)
        assert lobby.admit(4, Hello(), "c") == Admitted(VIEWER, evicted=3)
        assert lobby.roles == {1: VIEWER, 2: VIEWER, 4: VIEWER}
        assert isinstance(lobby.admit(5, Hello(), "d"), Refused)
        assert isinstance(lobby.admit(6, Hello(), "a"), Refused)
        assert lobby.roles == {1: VIEWER, 2: VIEWER, 4: VIEWER}

    def test_one_link_does_not_open_any_number_of_connections(self):
        lobby = Lobby(PAGE, limit=3)
        for guest in range(20):
            lobby.admit(guest, Hello(token=PAGE.seats["ann"], takeover=True), "a")
            lobby.admit(100 + guest, Hello(token=PAGE.official), "a")
        assert sorted(role.kind for role in lobby.roles.values()) == ["official"] * 3 + ["seat"] + ["viewer"] * 3
        assert lobby.holder(ANN) == 19


def test_whoever_talks_too_fast_is_stopped_and_a_driver_is_not():
    allowance = Allowance()
    assert sum(allowance.spend(10.0) for _ in range(1000)) == AT_ONCE
    assert not allowance.spend(10.0)
    assert allowance.spend(10.0 + 1.1 / PER_SECOND)
    driver = Allowance()
    assert all(driver.spend(number / 30) for number in range(3000))
