#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Run the tests in plain Python, under Blender's Python module (4.5; what is about Blender under 5.0's too) and in a
# real Blender: the one that BLENDER names, or the provisioned one.
#
#     tests/every_way.sh [--only plain|bpy|bpy-next|blender] [options for pytest]
#
# Plain Python has a core of its own beside the other ways, one after the other; its output comes last.
# A way that cannot be had here is skipped with a line that says why; asked for by --only, it is a failure.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=.venv/bin/python
failed=()
only=
said=$(mktemp -d)
beside=
trap '[ -z "$beside" ] || kill "$beside" 2>/dev/null; rm -rf "$said"' EXIT
if [ "${1:-}" = --only ]; then
    only=${2:-}
    [[ $only =~ ^(plain|bpy|bpy-next|blender)$ ]] || { echo "No such way to run the tests: '$only'" >&2; exit 2; }
    shift 2
fi
chosen=$#
blender=${BLENDER:-}
export OMP_WAIT_POLICY=PASSIVE
plain=(env LIQUID_SPLASH_NO_BPY=1 "$python" tests/run.py)

wanted() {
    [ -z "$only" ] || [ "$only" = "$1" ]
}

run() {
    printf '\n=== Tests in %s\n' "$1"
    local status=0
    "${@:2}" 2>&1 | tee "$said/output" || status=${PIPESTATUS[0]}
    # Said again at the end, which is all that a log's reader may see.
    grep -E '^(FAILED|ERROR) |^=+ .* in [0-9.]+s' "$said/output" | sed "s/^/$1: /" >> "$said/summary" || true
    # pytest's 5 is "no tests": a fault, unless somebody chose among them.
    [ "$status" = 0 ] || { [ "$status" = 5 ] && [ "$chosen" -gt 0 ]; } || failed+=("$1")
}

skip() {
    echo "Skipped: the tests in $1. $2"
    [ -z "$only" ] || failed+=("$1, which cannot be had here")
}

find_blender() {
    [ -z "$blender" ] || return 0
    local reason status=0
    # Progress to the terminal, the reason for not having it to us.
    { reason=$(PIP="$python -m pip" tests/provision_blender.sh 2>&1 >&3) || status=$?; } 3>&1
    case $status in
        0) blender=tests/blender.sh ;;
        2) skip "a real Blender" "$reason" ;;
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
            || { skip "bpy $version" "The package index does not give it."; return 0; }
        touch "$folder/.installed"
    fi
    # What the bundled weights give does not depend on Blender, and takes long.
    run "bpy $version" env PYTHONPATH="$folder" "$python" tests/run.py \
        tests/blender --ignore tests/blender/test_real_weights.py "$@"
}

# Provisioning comes first: who starts it should not wait for tests to learn that it fails.
! wanted blender || find_blender
if [ -n "$only" ]; then
    ! wanted plain || run "plain Python" "${plain[@]}" "$@"
else
    OMP_NUM_THREADS=1 "${plain[@]}" "$@" > "$said/plain" 2>&1 &
    beside=$!
    export OMP_NUM_THREADS=1
fi
! wanted bpy || run "bpy" "$python" tests/run.py "$@"
! wanted bpy-next || run_next_module "$@"
! wanted blender || [ -z "$blender" ] || run "Blender" "$blender" -b --factory-startup --python tests/run.py -- "$@"
if [ -z "$only" ]; then
    wait "$beside" && plain_status=0 || plain_status=$?
    beside=
    report() { cat "$said/plain"; return "$plain_status"; }
    run "plain Python" report
fi

printf '\n=== Summary\n'
[ ! -e "$said/summary" ] || cat "$said/summary"
if [ ${#failed[@]} -gt 0 ]; then
    printf 'Failed: %s\n' "${failed[@]}" >&2
    exit 1
fi
