#!/usr/bin/env bash
# A league of programs, for some rounds: each author writes a version, then they play.    examples/arena/run.sh [ROUNDS]
set -euo pipefail
here=$(dirname "$0") place=${VRG_ARENA:-build/arena}
mkdir -p "$place"
vrg league play "$place" --match "$here/match.toml" --games 1 > /dev/null  # the first time, it makes the league
for round in $(seq "${1:-5}"); do
    echo "round $round"
    vrg league improve "$place" "$here/authors.toml"
    vrg league play "$place" --games 8
done
