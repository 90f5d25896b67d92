"""Strategies are imported from their files as they are, apart from what lies elsewhere."""

import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import os
import py_compile
import sys
from pathlib import Path

import pytest

from vrg.agents.importing import import_object
from vrg.errors import ConfigError

USES_HELPER = "import helper\n\n\nclass Mine:\n    speed = helper.SPEED\n"


def rewrite(file: Path, text: str) -> None:
    """Change a file so that neither its size nor its time tells it: as an edit within the same second does."""
    before = file.stat()
    assert len(text) == before.st_size
    file.write_text(text)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def speed(folder: Path, target: str = "mine.py:Mine") -> object:
    return vars(import_object(target, folder))["speed"]


@pytest.mark.parametrize("target", ["mine.py:Mine", "mine:Mine"])
def test_a_file_that_was_edited_is_read_anew(tmp_path: Path, target: str) -> None:
    file = tmp_path / "mine.py"
    file.write_text("class Mine:\n    speed = 1\n")
    assert speed(tmp_path, target) == 1
    rewrite(file, "class Mine:\n    speed = 2\n")
    assert speed(tmp_path, target) == 2


def test_a_module_beside_it_that_was_edited_is_read_anew(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(USES_HELPER)
    helper = tmp_path / "helper.py"
    helper.write_text("from deep.inside import SPEED\n")
    (tmp_path / "deep").mkdir()
    inside = tmp_path / "deep" / "inside.py"
    inside.write_text("SPEED = 1\n")
    py_compile.compile(str(inside))
    assert speed(tmp_path) == 1
    rewrite(inside, "SPEED = 2\n")
    assert speed(tmp_path) == 2
    helper.write_text("SPEED = 3\n")
    assert speed(tmp_path) == 3


def test_a_file_that_a_module_names_is_read_anew_and_so_is_a_module_that_was_missing(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from pathlib import Path\n\nFILES = ['best.txt']\n\ntry:\n    import tuned\nexcept ImportError:\n"
        "    tuned = None\n\n\nclass Mine:\n"
        "    speed = (Path(__file__).with_name('best.txt').read_text(), tuned and tuned.SPEED)\n"
    )
    (tmp_path / "best.txt").write_text("slow")
    assert speed(tmp_path) == ("slow", None)
    (tmp_path / "best.txt").write_text("fast")
    assert speed(tmp_path) == ("fast", None)
    (tmp_path / "tuned.py").write_text("SPEED = 3\n")
    assert speed(tmp_path) == ("fast", 3)


def test_what_has_not_changed_is_imported_once(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(USES_HELPER)
    (tmp_path / "helper.py").write_text("SPEED = 1\n")
    assert import_object("mine.py:Mine", tmp_path) is import_object("mine.py:Mine", tmp_path)


def test_installed_modules_are_found_first(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import random\nimport vrg\nimport msgspec\n\n\nclass Mine:\n    speed = (random, vrg, msgspec)\n"
    )
    for name in ("random", "vrg", "msgspec"):
        (tmp_path / f"{name}.py").write_text("")
    assert speed(tmp_path) == tuple(importlib.import_module(name) for name in ("random", "vrg", "msgspec"))


def test_a_package_that_is_installed_from_a_folder_of_its_name_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As `pip install -e pack` does, whose finder comes after that of the import path."""
    (tmp_path / "pack_of_them" / "pack_of_them").mkdir(parents=True)
    inner = tmp_path / "pack_of_them" / "pack_of_them" / "__init__.py"
    inner.write_text("class Player: pass")

    class Editable(importlib.abc.MetaPathFinder):
        def find_spec(self, name: str, *_: object) -> importlib.machinery.ModuleSpec | None:
            return importlib.util.spec_from_file_location(name, inner) if name == "pack_of_them" else None

    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path, Editable()])
    found = import_object("pack_of_them:Player", tmp_path)
    assert found is sys.modules["pack_of_them"].Player
    del sys.modules["pack_of_them"]


def test_a_package_beside_a_strategy_imports_its_parts(tmp_path: Path) -> None:
    package = tmp_path / "tools"
    package.mkdir()
    (package / "__init__.py").write_text("from . import left\nfrom tools.right import SPEED as other\n")
    (package / "left.py").write_text("SPEED = 1\n")
    (package / "right.py").write_text("SPEED = 2\n")
    (tmp_path / "mine.py").write_text(
        "import tools.left as l\nimport tools.right\nfrom tools import other, right\n\n\nclass Mine:\n"
        "    speed = (l.SPEED, tools.right.SPEED, other, right is tools.right)\n"
    )
    assert speed(tmp_path) == (1, 2, 2, True)


def test_a_module_that_was_edited_is_read_anew_also_where_another_folder_has_one_of_its_name(tmp_path: Path) -> None:
    for name in ("ann", "bob"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.py").write_text(USES_HELPER)
        (tmp_path / name / "helper.py").write_text("SPEED = 1\n")
        assert speed(tmp_path / name) == 1
    assert import_object("mine.py:Mine", tmp_path / "bob") is import_object("mine.py:Mine", tmp_path / "bob")
    (tmp_path / "bob" / "helper.py").write_text("SPEED = 2\n")
    assert [speed(tmp_path / name) for name in ("ann", "bob", "ann", "bob")] == [1, 2, 1, 2]


def test_what_the_program_has_imported_before_it_was_edited_is_read_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.py").write_text("import early\n\n\nclass Mine:\n    speed = early.SPEED\n")
    (tmp_path / "early.py").write_text("SPEED = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert importlib.import_module("early").SPEED == 1
    (tmp_path / "early.py").write_text("SPEED = 22\n")
    assert speed(tmp_path) == 22


def test_a_fault_that_was_mended_in_the_same_second_is_gone(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(USES_HELPER)
    (tmp_path / "helper.py").write_text("SPEED = 1 / 0\n")
    with pytest.raises(ConfigError, match="division by zero"):
        import_object("mine.py:Mine", tmp_path)
    rewrite(tmp_path / "helper.py", "SPEED = 1 * 7\n")
    assert speed(tmp_path) == 7


def test_a_file_that_a_module_of_a_package_names_is_read_anew(tmp_path: Path) -> None:
    (tmp_path / "brain").mkdir()
    (tmp_path / "brain" / "__init__.py").write_text(
        "from pathlib import Path\n\nFILES = ['w.txt']\nSPEED = Path(__file__).with_name('w.txt').read_text()\n"
    )
    (tmp_path / "brain" / "w.txt").write_text("1")
    (tmp_path / "mine.py").write_text("import brain\n\n\nclass Mine:\n    speed = brain.SPEED\n")
    assert speed(tmp_path) == "1"
    (tmp_path / "brain" / "w.txt").write_text("2")
    assert speed(tmp_path) == "2"
