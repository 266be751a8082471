#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Run the tests in plain Python, under Blender's Python module (4.5; what is about Blender under 5.0's too) and in a
# real Blender: the one that BLENDER names, or the provisioned one.
#
#     tests/every_way.sh [options for pytest]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=.venv/bin/python
failed=()
chosen=$#
blender=${BLENDER:-}
export OMP_WAIT_POLICY=PASSIVE

run() {
    printf '\n=== Tests in %s\n' "$1"
    local status=0
    "${@:2}" || status=$?
    # pytest's 5 is "no tests": a fault, unless somebody chose among them.
    [ "$status" = 0 ] || { [ "$status" = 5 ] && [ "$chosen" -gt 0 ]; } || failed+=("$1")
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
    # Only the module differs from the way before, so it does not need an environment of its own.
    local version=5.0.1
    local folder=${XDG_CACHE_HOME:-$HOME/.cache}/liquid-splash/bpy-$version
    if [ ! -e "$folder/.installed" ]; then
        # shellcheck disable=SC2086  # PIP_ARGS is a list of words
        "$python" -m pip install ${PIP_ARGS:-} --quiet --no-deps --upgrade --target "$folder" "bpy==$version" \
            || { echo "Skipped: the tests under bpy $version, which the package index does not give."; return 0; }
        touch "$folder/.installed"
    fi
    # What the bundled weights give does not depend on Blender, and takes long.
    run "bpy $version" env PYTHONPATH="$folder" "$python" tests/run.py \
        tests/blender --ignore tests/blender/test_real_weights.py "$@"
}

find_blender
run "plain Python" env LIQUID_SPLASH_NO_BPY=1 "$python" tests/run.py "$@"
run "bpy" "$python" tests/run.py "$@"
run_next_module "$@"
[ -z "$blender" ] || run "Blender" "$blender" -b --factory-startup --python tests/run.py -- "$@"

if [ ${#failed[@]} -gt 0 ]; then
    printf 'Failed: %s\n' "${failed[@]}" >&2
    exit 1
fi
