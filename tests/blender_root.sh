#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Run a command inside the provisioned Debian root that holds a real Blender:
#
#     tests/blender_root.sh blender --version
#     tests/blender_root.sh bash -c 'xvfb-run -a blender --gpu-backend opengl'
#
# The checkout and /tmp are mounted at the same paths as outside, so file names mean the same on both sides.
set -euo pipefail

cache=${XDG_CACHE_HOME:-${HOME:-/root}/.cache}
root=${LIQUID_SPLASH_BLENDER_ROOT:-$cache/liquid-splash/blender-root}
checkout=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

enter() {
    mount --bind /tmp "$root/tmp"
    mkdir -p "$root$checkout"
    mount --bind "$checkout" "$root$checkout"
    # Recorded strokes, which some tests play back where they lie beside the checkout.
    local recordings
    recordings=$(dirname "$checkout")/shared/strokes
    if [ -d "$recordings" ]; then
        mkdir -p "$root$recordings"
        mount --bind --options ro "$recordings" "$root$recordings"
    fi
    mount --rbind /dev "$root/dev"
    mount --rbind /sys "$root/sys"
    mount -t proc proc "$root/proc"
    local folder=$PWD
    [ -d "$root$folder" ] || folder=$checkout
    # Not exec: bash stays as the namespace's first process, which the kernel shields from signals that it does not
    # handle; the trap makes Ctrl-C and kill end everything inside.
    trap 'exit 143' INT TERM HUP
    # Nothing of the caller's that names other places. Idle OpenMP threads must not spin on the cores of others.
    env -u LD_LIBRARY_PATH -u PYTHONHOME -u PYTHONPATH -u VIRTUAL_ENV -u TMPDIR \
        -u XDG_CACHE_HOME -u XDG_CONFIG_HOME -u XDG_DATA_HOME -u XDG_RUNTIME_DIR \
        HOME=/root LANG=C.UTF-8 OMP_WAIT_POLICY=PASSIVE \
        PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
        chroot "$root" bash -c 'cd "$0" && exec "$@"' "$folder" "$@" <&0 &
    wait $!
}

if [ "${LIQUID_SPLASH_ENTERED:-}" = yes ]; then
    unset LIQUID_SPLASH_ENTERED
    enter "$@"
    exit
fi

if [ ! -x "$root/usr/bin/bash" ]; then
    echo "There is no Blender root yet: run 'make blender' as root." >&2
    exit 3
fi
[ $# -gt 0 ] || set -- bash

# A mount and a process namespace of its own: when the command ends, or this script is killed, all its processes end
# and every mount goes with them, so that the root's folder can always be deleted safely.
export LIQUID_SPLASH_ENTERED=yes LIQUID_SPLASH_BLENDER_ROOT=$root
setpriv --pdeathsig KILL unshare --mount --pid --fork --kill-child bash "${BASH_SOURCE[0]}" "$@" <&0 &
inside=$!
trap 'kill -KILL "$inside" 2>/dev/null; exit 143' INT TERM HUP
wait "$inside"
