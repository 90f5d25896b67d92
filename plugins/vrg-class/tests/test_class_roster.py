"""Rosters as spreadsheets write them, and wrong words."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import ConfigError
from vrg_class.folder import MOST_STUDENTS
from vrg_class.roster import OF_DEVICE, OF_NAME, Guesses, listed, roster_of

BOTH = {"Ada": "apple", "Bo": "pear"}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Ada,apple\nBo, pear \n", BOTH),
        ("Ada;apple\r\nBo;pear\r\n", BOTH),
        ("Ada\tapple\nBo\tpear", BOTH),
        ("\ufeffName;Wort\nAda;apple\n\n;\nBo;pear;;;\n", BOTH),
        ('"Name","Password"\n"Ada","apple"\n"Bo","pear"\n', BOTH),
        ("Nr;Name;Klasse;Kennwort\n1;Ada;8b;apple\n2;Bo;8b;pear\n", BOTH),
        ("Nachname,Vorname,Wort\nLovelace,Ada,apple\n", {"Ada Lovelace": "apple"}),
        ("Nom;Prénom;Mot de passe\nCurie;Marie;radium\n", {"Marie Curie": "radium"}),
        ('"Lovelace, Ada";apple\n', {"Lovelace, Ada": "apple"}),
        ('"Lovelace, Ada",apple\n', {"Lovelace, Ada": "apple"}),
        ("Zoe\u0308,apple\n", {"Zoë": "apple"}),
        ("李雷,apple\nمحمد,pear\n", {"李雷": "apple", "محمد": "pear"}),
        ('"Ada\nLovelace",apple\nBo,pear\n', {"Ada Lovelace": "apple", "Bo": "pear"}),
    ],
)
def test_a_roster_is_read_as_spreadsheets_write_it(text: str, found: dict[str, str]) -> None:
    for coding in ("utf-8", "utf-8-sig", "utf-16", "utf-16-le"):
        assert roster_of(text.encode(coding), "names.csv") == found, coding


def test_a_roster_of_windows_is_read() -> None:
    assert roster_of("Jürgen;süß\r\nZoë;x\r\n".encode("cp1252"), "names.csv") == {"Jürgen": "süß", "Zoë": "x"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Ada\n", r"names\.csv:1: expected NAME,WORD, found no word"),
        ("Ada,apple\n\n\nBo,\n", r"names\.csv:4: expected NAME,WORD"),
        ('Name,Word\n"Ada\nLovelace",apple\nBo\n', r"names\.csv:4: "),
        ("Ada,apple\nBo,pear\nADA.,plum\n", r"names\.csv:3: line 1 has a name much like ADA"),
        ("Zoë,a\nZoe\u0308,b\n", "line 1 has a name much like"),
        ("Lovelace, Ada, apple\n", "put a name with a comma into quotation marks"),
        ('Ada,apple\nBo,"pear\nCy,plum\n', r"names\.csv:2: .*quotation mark"),
        ("=1+1,apple\n", "expected a name"),
        (f"{'W' * 61},apple\n", "1 to 60 letters"),
        ("", "found none"),
        ("Name,Word\n", "found none"),
        ("\n".join(f"Student {n},w" for n in range(MOST_STUDENTS + 1)), "65 names, and a class has room for 64"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(text: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        roster_of(text.encode(), "names.csv")


@given(st.binary(max_size=200))
def test_whatever_a_file_has_it_is_a_roster_or_told(data: bytes) -> None:
    found: dict[str, str] = {}
    with suppress(ConfigError):
        found = roster_of(data, "names.csv")
    assert all(name and word for name, word in found.items())


def test_names_and_words_may_be_typed_in_capitals() -> None:
    assert listed(BOTH, "ada", " APPLE ") == "Ada"
    assert listed(BOTH, "Ada", "pear") is None
    assert listed(BOTH, "Cy", "") is None
    assert listed({"Änne Groß": "x"}, "gross, änne", "x") == "Änne Groß", "the surname first"


def test_wrong_words_of_a_device_shut_out_that_device_alone() -> None:
    guesses = Guesses()
    for _ in range(OF_DEVICE):
        assert not guesses.are_over("Bo", "hers", 10.0)
        guesses.add("Bo", "hers")
    assert guesses.are_over("Bo", "hers", 11.0)
    assert guesses.are_over("Ada", "hers", 11.0)
    assert not guesses.are_over("Bo", "his", 11.0)
    assert not guesses.are_over("Bo", "hers", 70.0)
    for number in range(OF_NAME):
        guesses.add("Bo", f"device {number}")
    assert guesses.are_over("bo", "his", 71.0)
    assert not guesses.are_over("Ada", "his", 71.0)
