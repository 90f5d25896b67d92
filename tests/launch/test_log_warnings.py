"""The warnings of a process' log, for the terminal of who plays the match."""

from pathlib import Path

from vrg.launch.process_log import LogWarnings


def test_each_warning_comes_once_and_whole(tmp_path: Path) -> None:
    path = tmp_path / "eye.log"
    warnings = LogWarnings(path)
    assert warnings.new() == [], "there is no log yet"
    path.write_text("2026-11-26 08:00:00,001 INFO vrg.x: begins\n")
    with path.open("a") as log:
        log.write("2026-11-26 08:00:00,002 WARNING vrg.x: eye: it is dark\n")
    assert warnings.new() == ["eye: it is dark"]
    with path.open("a") as log:
        log.write("2026-11-26 08:00:01,000 ERROR vrg.y: eye: it is")
    assert warnings.new() == []
    with path.open("a") as log:
        log.write(" gone: WARNING\nTraceback (most recent call last):\n")
    assert warnings.new() == ["eye: it is gone: WARNING"]
    assert warnings.new() == []
    path.write_text("2026-11-26 08:00:02,000 WARNING vrg.x: anew\n")
    assert warnings.new() == ["anew"], "a log that has grown too long begins anew"
