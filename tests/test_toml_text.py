"""Lines of fields in TOML text."""

import tomllib

import pytest

from vrg.toml_text import line_of, lines_of, syntax_error_line, with_value_in, with_values

TEXT = """\
# a comment
name = "m"   # another
dotted.key = 1

[rules]
depth = 3

[[players]]
name = "a"

[[players]]
name = "b"
[players.options]
x = 1

[players.options.deep]
y = 1
[[players.friends]]
name = "c"
[[players.friends]]
name = "d"

[a . "b c"]
d = 2
"""


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("name",), 2),
        (("dotted", "key"), 3),
        (("rules",), 5),
        (("rules", "depth"), 6),
        (("players",), 8),
        (("players", 0, "name"), 9),
        (("players", 1), 11),
        (("players", 1, "name"), 12),
        (("players", 1, "options", "x"), 14),
        (("players", 1, "options", "deep", "y"), 17),
        (("players", 1, "options", "nothing"), 13),
        (("players", 1, "friends", 1, "name"), 21),
        (("a", "b c", "d"), 24),
    ],
)
def test_every_field_has_its_line(path: tuple[str | int, ...], line: int) -> None:
    assert line_of(lines_of(TEXT), path) == line


def test_a_missing_field_has_the_line_of_its_table() -> None:
    lines = lines_of(TEXT)
    assert line_of(lines, ("players", 1, "role")) == 11
    assert line_of(lines, ("rules", "x", "y")) == 5
    assert line_of(lines, ("nothing",)) == 1


def test_the_line_of_a_syntax_error() -> None:
    with pytest.raises(tomllib.TOMLDecodeError) as error:
        tomllib.loads("a = 1\nb = \n")
    assert syntax_error_line(error.value) == 2


def test_other_values_stand_in_place_of_the_old_ones_and_new_ones_at_the_top() -> None:
    changed = with_values(TEXT, {"name": "n", "seed": 3, "noise": False})
    data = tomllib.loads(changed)
    assert (data["name"], data["seed"], data["noise"]) == ("n", 3, False)
    assert data["rules"] == {"depth": 3}
    assert changed.count('name = "n"') == 1


def test_what_stands_inside_a_value_is_neither_a_table_nor_a_key() -> None:
    text = '''a = [
  [10, 8],  # [[not.a.table]]
  [1, 2],
]
b = """
[also.none]
c = 3
"""
d = { x = [1,
  [2]] }
e = "[" # [
[table]
f = 1
'''
    found = lines_of(text)
    assert found == {(): 1, ("a",): 1, ("b",): 5, ("d",): 9, ("e",): 11, ("table",): 12, ("table", "f"): 13}


def test_a_value_in_a_table_is_replaced_and_a_missing_one_is_added() -> None:
    text = with_value_in(TEXT, ("players", 1), "name", "z")
    text = with_value_in(text, ("players", 0), "strategy", 'mine.py:"A"')
    assert tomllib.loads(text)["players"][0] == {"name": "a", "strategy": 'mine.py:"A"'}
    assert tomllib.loads(text)["players"][1]["name"] == "z"
    assert tomllib.loads(text)["players"][1]["options"]["deep"] == {"y": 1}


def test_a_table_without_a_header_of_its_own_is_refused() -> None:
    with pytest.raises(ValueError, match=r"players\.0 with a header of its own, such as \[\[players\]\]"):
        with_value_in('players = [{name = "a"}]', ("players", 0), "name", "b")
