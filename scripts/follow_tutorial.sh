#!/bin/sh
# Follow docs/tutorial.md word for word in an empty container: a Debian of its own, where nothing but
# Python and the wheel of this checkout is installed. Ends at the first command whose exit code is
# not the one that the page says; each tells how long it took.
#
#   sudo scripts/follow_tutorial.sh [FOLDER]
#
# FOLDER (default: a temporary one) must not exist; it is removed at the end. Needs root and
# debootstrap; without either the tutorial is followed in a new virtual environment and an empty
# home. DEBIAN_MIRROR and SUITE choose where Debian comes from; settings of pip are those of the
# environment.
set -eu

here=$(cd "$(dirname "$0")/.." && pwd)
work=${1:-$(mktemp -d -u)}
suite=${SUITE:-bookworm}
[ ! -e "$work" ] || { echo "$work exists already" >&2; exit 2; }
mkdir -p "$work/wheel"
trap 'rm -rf --one-file-system "$work"' EXIT
trap 'exit 130' INT TERM

told() {
    echo "== $1 [$(($(date +%s) - began)) s]"
    began=$(date +%s)
}
began=$(date +%s)
begin=$began

mkdir "$work/source"
git -C "$here" archive HEAD | tar -x -C "$work/source"
python3 -m pip wheel --quiet --no-deps --wheel-dir "$work/wheel" "$work/source"
told "the wheel $(basename "$work"/wheel/*.whl)"

# What pip was told of the network goes along, nothing else.
pip_settings=$(env | grep '^PIP_' || true)
inside="set -eu; cd /tmp; python3 -m venv venv; venv/bin/pip install --quiet wheel/*.whl; \
    mkdir empty; cd empty; PATH=/tmp/venv/bin:\$PATH python3 ../source/scripts/run_tutorial.py"

if [ "$(id -u)" = 0 ] && command -v debootstrap >/dev/null; then
    root=$work/root
    debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates \
        "$suite" "$root" ${DEBIAN_MIRROR:+"$DEBIAN_MIRROR"} >"$work/debootstrap.log" ||
        { tail -5 "$work/debootstrap.log" >&2; exit 2; }
    told "an empty Debian $suite"
    cp /etc/resolv.conf "$root/etc/"
    cp /etc/hosts "$root/etc/"
    for file in /etc/pip.conf /etc/ssl/certs/ca-certificates.crt "${PIP_CERT:-}"; do
        [ ! -f "$file" ] || { mkdir -p "$root$(dirname "$file")"; cp "$file" "$root$file"; }
    done
    mv "$work/wheel" "$work/source" "$root/tmp/"
    # shellcheck disable=SC2086  # several settings
    chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/bin:/bin LANG=C.UTF-8 $pip_settings \
        sh -c "$inside"
else
    echo 'no root or no debootstrap: an empty home and a new virtual environment'
    mkdir "$work/home"
    mkdir "$work/tmp"
    mv "$work/wheel" "$work/source" "$work/tmp/"
    # shellcheck disable=SC2086  # several settings
    env -i HOME="$work/home" PATH="$PATH" LANG=C.UTF-8 $pip_settings \
        sh -c "$(echo "$inside" | sed "s#/tmp#$work/tmp#g")"
fi
told 'the tutorial, and what it needs'
echo "== all of it [$(($(date +%s) - begin)) s]"
