"""The JSON schema of each type in a recording, in the few words that viewers understand.

The readers in Foxglove and in Lichtblick refuse a whole channel for one word that they do not know. They know objects
with `properties`, arrays of anything but arrays, strings (also base64), booleans and numbers. They know no references,
no unions, no null, and no field without a type.
"""

from typing import Any, Final

import msgspec
from msgspec import Struct

from vrg.recording import foxglove as fg

_Node = dict[str, Any]
_TYPE_WORDS: Final[dict[type, str]] = {str: "string", bool: "boolean", int: "integer", float: "number"}


def schema_name(kind: type[Struct]) -> str:
    """The name of a type's schema: one that viewers know for a type of `vrg.recording.foxglove`, or an own one."""
    return f"{'foxglove' if kind.__module__ == fg.__name__ else 'vrg'}.{kind.__name__}"


def json_schema(kind: type[Struct]) -> bytes:
    """The JSON schema of a type. What viewers cannot describe is left out of it, but not out of the messages."""
    node = msgspec.json.schema(kind)
    plain = _plain(node, node.get("$defs", {}), frozenset())
    return msgspec.json.encode(plain)


def _plain(node: _Node, definitions: dict[str, _Node], within: frozenset[str]) -> _Node | None:
    """The node without the words that viewers do not know, or None for one that they cannot describe.

    Args:
        within: the definitions that this node is a part of; one that contains itself has no end.
    """
    reference = node.get("$ref")
    if reference is not None:
        name = reference.rsplit("/", 1)[1]
        return None if name in within else _plain(definitions[name], definitions, within | {name})
    if "anyOf" in node:
        return _union([_plain(option, definitions, within) for option in node["anyOf"] if option.get("type") != "null"])
    kind = node.get("type")
    if kind == "object":
        fields = {name: _plain(field, definitions, within) for name, field in node.get("properties", {}).items()}
        return {"type": kind, "properties": {name: field for name, field in fields.items() if field is not None}}
    if kind == "array":
        # A tuple names its items one by one; viewers take the first for all of them.
        items = node.get("prefixItems", [None])[0] or node.get("items") or {}
        return _array(_plain(items, definitions, within))
    if kind in _TYPE_WORDS.values():
        # Viewers pass over the description, in which is the unit.
        return {word: node[word] for word in ("type", "contentEncoding", "description") if word in node}
    return _constant(node.get("enum", [node.get("const")]))


def _array(item: _Node | None) -> _Node | None:
    describable = item is not None and item["type"] != "array" and "contentEncoding" not in item
    return {"type": "array", "items": item} if describable else None


def _constant(values: list[Any]) -> _Node | None:
    word = _TYPE_WORDS.get(type(values[0]))
    return None if word is None else {"type": word}


def _union(options: list[_Node | None]) -> _Node | None:
    """One node for what is one of several: objects become one object that has the fields of them all."""
    described = [option for option in options if option is not None]
    if len(described) != len(options) or not described:
        return None
    if len(described) > 1 and any(option["type"] != "object" for option in described):
        return None
    merged = dict(described[0])
    for option in described[1:]:
        merged["properties"] = {**merged["properties"], **option["properties"]}
    return merged
