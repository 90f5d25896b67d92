# make play    plays a match of Sharks and Minnows and shows it
# make test    runs every check and test
# make vcan    runs the tests on a CAN bus only, on a virtual one that it makes itself
# make setup   makes .venv, which all of the above do by themselves

.PHONY: setup play test lint unit system system-robots system-matches vcan vcan-robots vcan-matches lock clean

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

# Emulated motor controllers run in real time and mostly sleep: many at once, with nothing else beside them.
unit: setup
	$(VENV)/python -m pytest -q -n 2 --dist worksteal -m "not system and not vcan" --ignore tests/hal/can
	$(VENV)/python -m pytest -q -n 5 --dist worksteal -m "not system and not vcan" tests/hal/can

# Two lots at once, each in a network of its own, so that what they send stays here. In each lot one at a time: every
# test starts a dozen processes.
system: setup
	@$(MAKE) --no-print-directory --jobs 2 --output-sync system-robots system-matches

# Half of the tests, by their time: robots on CAN frames in multicast, several hosts, seats, faults, benchmarks.
ROBOTS := $(addprefix tests/system/test_,hosts.py mixed.py leases.py seats.py sandbox.py stops.py commander.py \
	benchmarks.py pursuit_evasion.py)

system-robots:
	scripts/with-loopback $(VENV)/python -m pytest -q -m "system and not vcan" $(ROBOTS)

system-matches:
	scripts/with-loopback $(VENV)/python -m pytest -q -m "system and not vcan" $(addprefix --ignore=,$(ROBOTS))

# Two lots at once, each with a bus of its own; where the kernel has no CAN, each in a kernel with one CPU.
vcan: setup
	@$(MAKE) --no-print-directory --jobs 2 --output-sync vcan-robots vcan-matches

# One test at a time, as above: what hogs that CPU makes a drive's heartbeat late. That kernel collects tests slowly, so
# the folders are named.
ON_CAN := tests/hal/can/test_contract.py tests/system/test_can_tools.py

vcan-robots:
	scripts/with-vcan $(VENV)/python -m pytest -q -m vcan $(ON_CAN)

vcan-matches:
	scripts/with-vcan $(VENV)/python -m pytest -q -m vcan tests/hal/can tests/system $(addprefix --ignore=,$(ON_CAN))

# New versions of what VRG depends on; needs uv.
lock:
	uv pip compile pyproject.toml --extra dev --python-version 3.11 --universal --generate-hashes --allow-unsafe \
		--no-emit-index-url --no-annotate --no-header --output-file requirements.lock

clean:
	rm -rf .venv build *.egg-info
