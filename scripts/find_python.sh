#!/usr/bin/env bash
# Print a Python that can carry the project: 3.12 or 3.11, with headers (the interface package is compiled against it).
# With ROS 2 sourced only the Python that ROS 2 was built for will do, which is python3.
set -u
candidates=(python3.12 python3.11 python3 python)
[ -n "${ROS_DISTRO:-}" ] && candidates=(python3)
check='import os, sys, sysconfig
assert sys.version_info[:2] in ((3, 11), (3, 12))
import ensurepip, venv
assert os.path.isfile(os.path.join(sysconfig.get_path("include"), "Python.h"))'
for candidate in ${PYTHON:-${candidates[@]}}; do
    if "$candidate" -c "$check" >/dev/null 2>&1; then
        command -v "$candidate"
        exit 0
    fi
done
cat >&2 <<'END'
No usable Python found. Needed: Python 3.11 or 3.12 with venv and headers; with ROS 2 sourced, its own python3.
On Debian or Ubuntu: sudo apt install python3 python3-venv python3-dev. Or name one: make PYTHON=/path/to/python3.12
END
exit 1
