#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Run the tests in plain Python, under Blender's Python module and in a real Blender:
#
#     tests/every_way.sh [--slow] [options for pytest]
#
# --slow runs the tests marked slow instead, and the others once more under Blender 5.0's module.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=.venv/bin/python
failed=()
blender=${BLENDER:-}
slow=no
if [ "${1:-}" = --slow ]; then
    slow=yes
    shift
    set -- -m slow "$@"
fi
export OMP_WAIT_POLICY=PASSIVE

run() {
    printf '\n=== Tests in %s\n' "$1"
    "${@:2}" || failed+=("$1")
}

find_blender() {
    [ -z "$blender" ] || return 0
    local reason status=0
    # Progress to the terminal, the reason for not having it to us.
    { reason=$(PIP="$python -m pip" tests/provision_blender.sh 2>&1 >&3) || status=$?; } 3>&1
    case $status in
        0) blender=tests/blender.sh ;;
        2) echo "Skipped: the tests in a real Blender. $reason" ;;
        *) echo "$reason" >&2; failed+=("provisioning") ;;
    esac
}

run_next_module() {
    # Only the module differs from the second way, so it need not have an environment of its own.
    local folder=${XDG_CACHE_HOME:-$HOME/.cache}/liquid-splash/bpy-5.0.1
    if [ ! -e "$folder/.installed" ]; then
        # shellcheck disable=SC2086  # PIP_ARGS is a list of words
        "$python" -m pip install ${PIP_ARGS:-} --quiet --no-deps --upgrade --target "$folder" bpy==5.0.1 \
            || { echo "Skipped: the tests under bpy 5.0.1, which the package index does not give."; return 0; }
        touch "$folder/.installed"
    fi
    run "bpy 5.0.1" env PYTHONPATH="$folder" "$python" tests/run.py tests/blender
}

find_blender
run "plain Python" env LIQUID_SPLASH_NO_BPY=1 "$python" tests/run.py "$@"
run "bpy" "$python" tests/run.py "$@"
[ -z "$blender" ] || run "Blender" "$blender" -b --factory-startup --python tests/run.py -- "$@"
[ "$slow" = no ] || run_next_module

if [ ${#failed[@]} -gt 0 ]; then
    printf 'Failed: %s\n' "${failed[@]}" >&2
    exit 1
fi
