"""The release: what refuses it, and that a version is written wherever it stands."""

import datetime
import runpy
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
RELEASE: dict[str, Any] = runpy.run_path(str(ROOT / "scripts" / "release"))
CHANGELOG = "# Changelog\n\n## Unreleased\n\n- A thing.\n\n## 0.1.0\n\n- The first.\n"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A repository with the files that name a version."""
    (tmp_path / "plugins" / "one").mkdir(parents=True)
    (tmp_path / "vrg").mkdir()
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "a"\nversion = "0.1.0"\n')
    (tmp_path / "plugins" / "one" / "pyproject.toml").write_text('version = "0.1.0"\ndependencies = ["a==0.1.0"]\n')
    (tmp_path / "vrg" / "__init__.py").write_text('__version__ = "0.1.0"\n')
    (tmp_path / "CITATION.cff").write_text("version: 0.1.0\n")
    (tmp_path / "CHANGELOG.md").write_text(CHANGELOG)
    for words in (("init", "-q"), ("add", "-A"), ("-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "a")):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    return tmp_path


@pytest.mark.parametrize(
    ("version", "file", "text", "why"),
    [
        ("two", None, "", "expected a version such as 0.2.0, got 'two'"),
        ("0.1.0", None, "", "expected a version after 0.1.0, got 0.1.0"),
        ("0.0.9", None, "", "expected a version after 0.1.0, got 0.0.9"),
        ("0.2.0", "new.py", "", "expected a work tree without changes"),
    ],
)
def test_a_release_that_makes_no_sense_is_refused(
    project: Path, version: str, file: str | None, text: str, why: str
) -> None:
    if file is not None:
        (project / file).write_text(text)
    with pytest.raises(SystemExit, match=why):
        RELEASE["check"](project, version)


@pytest.mark.parametrize(
    ("changelog", "why"),
    [
        (CHANGELOG.replace("- A thing.\n", ""), "found nothing"),
        (CHANGELOG.replace("## 0.1.0", "## 0.2.0"), "has a section of 0.2.0 already"),
    ],
)
def test_a_release_needs_its_news(project: Path, changelog: str, why: str) -> None:
    (project / "CHANGELOG.md").write_text(changelog)
    subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qam", "b"], cwd=project, check=True)
    with pytest.raises(SystemExit, match=why):
        RELEASE["check"](project, "0.2.0")


def test_the_version_is_set_wherever_it_stands(project: Path) -> None:
    RELEASE["check"](project, "0.2.0")
    RELEASE["set_version"](project, "0.2.0", datetime.date(2026, 12, 1))
    for file in ("pyproject.toml", "plugins/one/pyproject.toml", "vrg/__init__.py", "CITATION.cff"):
        text = (project / file).read_text()
        assert "0.2.0" in text, file
        assert "0.1.0" not in text, file
    changelog = (project / "CHANGELOG.md").read_text()
    assert "## Unreleased\n\n## 0.2.0 (2026-12-01)\n\n- A thing.\n" in changelog
    assert RELEASE["news"](changelog) == ""


def test_every_file_of_the_project_that_names_its_version_names_the_same() -> None:
    version = RELEASE["present"](ROOT)
    files = [file for pattern in RELEASE["WITH_VERSION"] for file in ROOT.glob(pattern)]
    assert len(files) > 12
    assert [file for file in files if version not in file.read_text(encoding="utf-8")] == []
