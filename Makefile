# make play      plays a match of Sharks and Minnows and shows it
# make test      runs the checks and tests of every change, in lots: scripts/lots
# make test-all  runs everything, with many more examples, seeds and whole matches: before a capability is done
# make docs      builds the site of the documentation in build/site
# make vcan      runs the tests on a CAN bus only, on a virtual one that it makes itself
# make findings  runs what libraries do against expectation, and names what has changed; needs a connection
# make setup     makes .venv, which all of the above do by themselves

.PHONY: setup docs findings play test test-all lint unit system vcan lock clean

VENV := .venv/bin

setup:
	@scripts/setup

docs: setup
	@$(VENV)/python scripts/docs

play: setup
	$(VENV)/vrg play sharks-and-minnows

test: setup
	@$(VENV)/python scripts/lots

test-all: setup
	@$(VENV)/python scripts/lots --all

# Some of the lots alone. `scripts/lots --list` tells them all.
unit: setup
	@$(VENV)/python scripts/lots can unit

lint system vcan: setup
	@$(VENV)/python scripts/lots $@

findings:
	@changed=""; for script in findings/*.sh; do \
		echo "== $$script"; "$$script" || { [ $$? = 75 ] || changed="$$changed $$script"; }; \
	done; [ -z "$$changed" ] || { echo "findings: changed:$$changed" >&2; exit 1; }

# New versions of what VRG depends on; needs uv.
lock:
	uv pip compile pyproject.toml --extra play --extra dev --python-version 3.11 --universal --generate-hashes --allow-unsafe \
		--no-emit-index-url --no-annotate --no-header --output-file requirements.lock

clean:
	rm -rf .venv build *.egg-info
