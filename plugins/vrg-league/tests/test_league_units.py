"""The units of systemd that let a league play every night."""

from pathlib import Path

from tests.command_line import Vrg
from tests.test_deploy import check_command, check_units

DEPLOY = Path(__file__).parents[1] / "deploy"


def test_the_command_of_the_league_exists_with_these_options(vrg: Vrg) -> None:
    check_command(DEPLOY / "vrg-league.service", vrg)


def test_systemd_accepts_the_units_of_the_league(tmp_path: Path) -> None:
    check_units(DEPLOY, tmp_path)
