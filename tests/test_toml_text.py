"""TOML text: the lines of fields, and edits."""

import copy
import json
import tomllib
from functools import reduce
from operator import getitem
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import Path
from vrg.tables import lines_of
from vrg.toml_text import with_item, with_value, without


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
    own = {path: line for path, line in found.items() if len(path) < 2 or path[0] == "table"}
    assert own == {(): 1, ("a",): 1, ("b",): 5, ("d",): 9, ("e",): 11, ("table",): 12, ("table", "f"): 13}


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
    text = with_value(with_value(MATCH, ("seed",), 42), ("a",), 5)
    assert 'seed = 42        # any "number" # will do\n' in text
    assert "a = 5    # both\n" in text
    assert "  # a sign\n" in with_value(MATCH, ("rules", "x"), "y")


def test_a_new_field_stands_below_the_others_of_its_table() -> None:
    lines = with_value(MATCH, ("engine",), "planar").splitlines()
    assert lines[lines.index('engine = "planar"') - 1].startswith("seed")
    assert 'name = "b"\nmodel = "AT"\n\n# what follows\n' in with_value(MATCH, ("players", 1, "model"), "AT")
    assert with_value("[rules]\n", ("seed",), 1) == "seed = 1\n[rules]\n"


def test_a_table_is_added_behind_the_last_of_its_array() -> None:
    text = with_item(MATCH, "players", {"name": "c", "x": 1.5})
    assert [p["name"] for p in tomllib.loads(text)["players"]] == ["a", "b", "c"]
    assert 'name = "b"\n\n[[players]]\nname = "c"\nx = 1.5\n\n# what follows\n' in text
    for before in ("a = 1\n", "a = 1"):
        assert tomllib.loads(with_item(before, "players", {"name": "c"})) == {"a": 1, "players": [{"name": "c"}]}


def test_a_table_goes_with_its_own_comments_and_the_tables_below_it() -> None:
    text = without(MATCH, ("players", 0))
    assert "first" not in text
    assert "options" not in text
    assert "# the second\n[[players]]" in text
    text = without(text, ("players", 0))
    assert "second" not in text
    assert "# what follows\n[backends.can]" in text
    assert without(text, ("players", 0)) == text
    assert without(text, ("rules", "model")) == text
    assert without(text, ("name", "model")) == text, "name is no table"


WORDS = st.sampled_from(["a", "b c", "d.e", "", 'f"', "g#", "[h]", "\u2028", "\u00fc", "#"])
SCALARS = st.one_of(WORDS, st.integers(-9, 9), st.booleans(), st.sampled_from([0.5, -1e30]), st.just("two\nlines"))


def _tables(inner: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.lists(st.dictionaries(WORDS, inner, max_size=2), min_size=1, max_size=3)


VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(SCALARS, max_size=3) | st.dictionaries(WORDS, inner, max_size=3) | _tables(inner),
    max_leaves=12,
)


def _inline(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_inline(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[\n  " + ", # [x]\n  ".join(map(_inline, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def _key(key: str) -> str:
    return json.dumps(key, ensure_ascii=False)


def _lines(draw: st.DrawFn, table: dict[str, Any], path: tuple[str, ...]) -> list[str]:
    """A table in one of the ways in which people may write it, each field with a comment of its own."""
    fields, tables = [], []
    for key, value in table.items():
        here = (*path, key)
        name = " . ".join(map(_key, here))
        way = draw(st.sampled_from(["inline", "dotted", "header"]))
        if isinstance(value, dict) and way == "header":
            tables += [f"# about {name!r}", f"[{name}]  # of {name!r}", *_lines(draw, value, here)]
        elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value) and way == "header":
            for one in value:
                tables += ["", f"[[ {name} ]]", *_lines(draw, one, here)]
        elif isinstance(value, dict) and value and way == "dotted":
            fields += [f"{_key(key)}.{_key(inner)} = {_inline(one)} # {inner!r}" for inner, one in value.items()]
        else:
            fields.append(f"{_key(key)} = {_inline(value)}   # it is {key!r}")
    return [*fields, *tables]


@st.composite
def files(draw: st.DrawFn) -> tuple[str, dict[str, Any]]:
    """The text of a file, and what it holds."""
    data = draw(st.dictionaries(WORDS, VALUES, max_size=4))
    return "\n".join(_lines(draw, data, ())) + draw(st.sampled_from(["", "\n", "\n\n# the end\n"])), data


def tables_in(value: Any, path: Path = ()) -> list[Path]:
    """The paths of all tables."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    own = [path] if isinstance(value, dict) else []
    return own + [found for key, one in inner for found in tables_in(one, (*path, key))]


@given(files(), st.data())
def test_any_field_of_any_table_can_be_set_and_taken_out(file: tuple[str, dict[str, Any]], data: st.DataObject) -> None:
    text, before = file
    assert tomllib.loads(text) == before
    path = data.draw(st.sampled_from(tables_in(before)))
    key, value = data.draw(WORDS), data.draw(SCALARS)
    after = copy.deepcopy(before)
    table: Any = reduce(getitem, path, after)
    table[key] = value
    changed = with_value(text, (*path, key), value)
    assert tomllib.loads(changed) == after
    del table[key]
    left = tomllib.loads(without(changed, (*path, key)))
    if left != after and not table and path and isinstance(path[-1], str):
        # A table that only a dotted key has made goes with its last field.
        del reduce(getitem, path[:-1], after)[path[-1]]
    assert left == after


@given(files(), st.data())
def test_an_item_of_any_array_of_tables_can_be_added_and_taken_out(
    file: tuple[str, dict[str, Any]], data: st.DataObject
) -> None:
    text, after = file
    arrays = [key for key, value in after.items() if isinstance(value, list) and value and isinstance(value[0], dict)]
    array = data.draw(st.sampled_from([*arrays, "another"]))
    item = data.draw(st.dictionaries(WORDS, SCALARS, min_size=1, max_size=3))
    changed = with_item(text, array, item)
    after.setdefault(array, []).append(item)
    assert tomllib.loads(changed) == after
    number = data.draw(st.integers(0, len(after[array]) - 1))
    del after[array][number]
    left = tomllib.loads(without(changed, (array, number)))
    assert {**left, array: left.get(array, [])} == after


@given(files())
def test_every_field_and_item_has_a_line(file: tuple[str, dict[str, Any]]) -> None:
    text, data = file
    lines = lines_of(text)
    for path in tables_in(data):
        for key in reduce(getitem, path, data):
            line = text.split("\n")[lines[*path, key] - 1]
            assert any(json.dumps(str(part), ensure_ascii=False) in line for part in (*path, key)), (path, key, line)
