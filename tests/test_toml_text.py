"""Lines of fields in TOML text."""

import tomllib

import pytest

from vrg.toml_text import (
    line_of,
    lines_of,
    syntax_error_line,
    with_item,
    with_value_in,
    with_values,
    without_item,
    without_value_in,
)

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


def test_every_field_has_its_line() -> None:
    expected: dict[tuple[str | int, ...], int] = {
        ("name",): 2,
        ("dotted", "key"): 3,
        ("rules",): 5,
        ("rules", "depth"): 6,
        ("players",): 8,
        ("players", 0, "name"): 9,
        ("players", 1): 11,
        ("players", 1, "name"): 12,
        ("players", 1, "options", "x"): 14,
        ("players", 1, "options", "deep", "y"): 17,
        ("players", 1, "options", "nothing"): 13,
        ("players", 1, "friends", 1, "name"): 21,
        ("a", "b c", "d"): 24,
    }
    found = {path: line_of(lines_of(TEXT), path) for path in expected}
    wrong = [f"{path}: line {found[path]}, expected {line}" for path, line in expected.items() if found[path] != line]
    assert not wrong, "\n".join(wrong)


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


MATCH = """\
# who plays
name = "m"
a = [1, # one
  2]    # both
seed = 3        # any "number" # will do

[rules]
x = '#'  # a sign

# the first
[[players]]
name = "a"      # a comment
[players.options]
x = 1

# the second
[[players]]
name = "b"

# what follows
[backends.can]
x = 1
"""


def test_a_comment_behind_a_value_stays_with_its_field() -> None:
    text = with_values(MATCH, {"seed": 42, "a": 5})
    assert 'seed = 42       # any "number" # will do\n' in text
    assert "a = 5   # both\n" in text
    assert "  # a sign\n" in with_value_in(text, ("rules",), "x", "y")


def test_a_new_field_of_the_file_stands_below_the_others() -> None:
    lines = with_values(MATCH, {"engine": "planar"}).splitlines()
    assert lines[lines.index('engine = "planar"') - 1].startswith("seed")
    assert with_values("[rules]\n", {"seed": 1}) == "seed = 1\n[rules]\n"


def test_a_table_is_added_behind_the_last_of_its_array() -> None:
    text = with_item(MATCH, "players", {"name": "c", "x": 1.5})
    assert [p["name"] for p in tomllib.loads(text)["players"]] == ["a", "b", "c"]
    assert 'name = "b"\n\n[[players]]\nname = "c"\nx = 1.5\n\n# what follows\n' in text
    assert tomllib.loads(with_item("a = 1\n", "players", {"name": "c"})) == {"a": 1, "players": [{"name": "c"}]}


def test_a_table_goes_with_its_own_comments_and_the_tables_below_it() -> None:
    text = without_item(MATCH, ("players", 0))
    assert "first" not in text
    assert "options" not in text
    assert "# the second\n[[players]]" in text
    text = without_item(text, ("players", 0))
    assert "second" not in text
    assert "# what follows\n[backends.can]" in text
    with pytest.raises(ValueError, match="a header of its own"):
        without_item(text, ("players", 0))


def test_a_field_is_taken_out() -> None:
    text = without_value_in(MATCH, (), "a")
    assert tomllib.loads(text) == {k: v for k, v in tomllib.loads(MATCH).items() if k != "a"}
    assert without_value_in(MATCH, ("players", 1), "model") == MATCH
