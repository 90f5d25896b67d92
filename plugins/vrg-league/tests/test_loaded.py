"""What a game of an experiment loads."""

from vrg.testing.loading import loaded


def test_a_game_of_an_experiment_draws_nothing_and_writes_no_tables() -> None:
    code = "import vrg_league.playing, vrg_league.game_process, vrg_league.workers"
    assert loaded(code, ("pygame", "matplotlib", "pyarrow", "aiohttp", "vrg.ui", "vrg_league.ui")) == []
