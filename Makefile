# make play    plays a match of Sharks and Minnows and shows it
# make test    runs every check and test
# make vcan    runs the tests on a CAN bus only, on a virtual one that it makes itself
# make setup   makes .venv, which all of the above do by themselves

.PHONY: setup play test lint unit system vcan vcan-robots vcan-matches lock clean

VENV := .venv/bin

setup:
	@scripts/setup

play: setup
	$(VENV)/vrg play sharks-and-minnows

test: lint unit system vcan

lint: setup
	$(VENV)/ruff check .
	$(VENV)/ruff format --check .
	$(VENV)/mypy

unit: setup
	$(VENV)/python -m pytest -q -n 4 --dist worksteal -m "not system and not vcan"

# One at a time: each starts a dozen processes. In a network of their own, so that what they send stays here.
system: setup
	scripts/with-loopback $(VENV)/python -m pytest -q -m "system and not vcan"

# Two lots at once, each with a bus of its own; where the kernel has no CAN, each in a kernel with one CPU.
vcan: setup
	@$(MAKE) --no-print-directory --jobs 2 --output-sync vcan-robots vcan-matches

# One test at a time, as above: what hogs that CPU makes a drive's heartbeat late.
vcan-robots:
	scripts/with-vcan $(VENV)/python -m pytest -q -m "vcan and not system"

vcan-matches:
	scripts/with-vcan $(VENV)/python -m pytest -q -m "vcan and system"

# New versions of what VRG depends on; needs uv.
lock:
	uv pip compile pyproject.toml --extra dev --python-version 3.11 --universal --generate-hashes --allow-unsafe \
		--no-emit-index-url --no-annotate --no-header --output-file requirements.lock

clean:
	rm -rf .venv build *.egg-info
