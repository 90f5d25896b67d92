# make play    plays a match of Sharks and Minnows and shows it
# make test    runs every check and test
# make setup   makes .venv, which both of the above do by themselves

.PHONY: setup play test lint unit system lock clean

VENV := .venv/bin

setup:
	@scripts/setup

play: setup
	$(VENV)/vrg play sharks-and-minnows

test: lint unit system

lint: setup
	$(VENV)/ruff check .
	$(VENV)/ruff format --check .
	$(VENV)/mypy

unit: setup
	$(VENV)/python -m pytest -q -n 2 -m "not system"

# One at a time: each starts a dozen processes.
system: setup
	$(VENV)/python -m pytest -q -m system

# New versions of what VRG depends on; needs uv.
lock:
	uv pip compile pyproject.toml --extra dev --python-version 3.11 --universal --generate-hashes --allow-unsafe \
		--no-emit-index-url --no-annotate --no-header --output-file requirements.lock

clean:
	rm -rf .venv build *.egg-info
