"""The match of a game as it is written: with other strategies, in any form of TOML."""

from pathlib import Path

import pytest

from vrg.config.loading import load_match, match_path
from vrg.testing.tiny import forms
from vrg_league.contenders import teams_of
from vrg_league.experiment import written

TABLE = match_path("sharks-and-minnows-table-4-2").read_text(encoding="utf-8")
FORMS = forms(TABLE.replace('map = "courtyard"\n', 'map = "courtyard"\nengine = "pybullet"\n'))


@pytest.mark.parametrize("text", FORMS.values(), ids=FORMS)
def test_a_match_in_any_form_of_toml_is_written_with_the_strategies_that_are_compared(
    tmp_path: Path, text: str
) -> None:
    path = tmp_path / "match.toml"
    path.write_text(text, encoding="utf-8")
    plain, setup = load_match(path), load_match(path, seed=7, engine="planar", rate=2.5)
    setup = written(setup, {team: f"{team}.x:Player" for team in teams_of(setup)}, "secret")
    path.write_text(setup.text, encoding="utf-8")
    again = load_match(path)
    assert (again.seed, again.engine, again.rate, again.rules) == (7, "planar", 2.5, plain.rules)
    assert {player.strategy for player in again.players} == {f"{team}.x:Player" for team in teams_of(setup)}
