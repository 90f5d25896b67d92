# Sourced by each script with the packages that it needs: an environment of their own in a folder that does not stay.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
"${PYTHON:-python3}" -m venv "$place/environment"
python=$place/environment/bin/python
"$python" -m pip install --quiet --disable-pip-version-check "$@" || {
    echo "$0: the packages cannot be installed: is there a connection?" >&2
    exit 75
}
cd "$place"
