"""What a person is told when ssh has failed."""

import pytest

from vrg.launch.remote.ssh import advice


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("ssh: Could not resolve hostname lab2: Name or service not known", "check `host` in [machines.red]"),
        ("Host key verification failed.", "run `ssh ann@lab2` once"),
        ("ann@lab2: Permission denied (publickey).", "`ssh-copy-id ann@lab2`"),
        ("ssh: connect to host lab2 port 22: Connection refused", "start the ssh server there"),
        ("ssh: connect to host lab2 port 22: Connection timed out", "firewall"),
        ("ssh: connect to host lab2 port 22: No route to host", "switched on"),
        ("", "`ssh ann@lab2 true` must work"),
    ],
)
def test_each_cause_has_its_own_advice(said: str, told: str) -> None:
    text = advice(said, "red", "ann@lab2")
    assert told in text
    assert text.endswith("`ssh ann@lab2 true` must work without asking anything")
