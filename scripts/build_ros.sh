#!/usr/bin/env bash
# Build actuator_glue_msgs and install the nodes below install/, where `ros2 run` looks for them.
# --symlink-install: nodes run the sources themselves, so edits need no second build.
set -euo pipefail
cd "$(dirname "$0")/.."
venv=$PWD/.venv
export PATH="$venv/bin:$PATH" VIRTUAL_ENV="$venv"
if [ -z "${ROS_DISTRO:-}" ]; then
    export AMENT_PREFIX_PATH="$venv" CMAKE_PREFIX_PATH="$venv"
    unset COLCON_PREFIX_PATH PYTHONPATH
fi
echo 'set-up: building the interface package with colcon (half a minute)'
colcon --log-base log build --base-paths . msg_defs --symlink-install --event-handlers console_direct- \
    --cmake-args -DBUILD_TESTING=OFF -DPython3_EXECUTABLE="$venv/bin/python" "$@"
