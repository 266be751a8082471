#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Run the tests in plain Python, under Blender's Python module (4.5; what is about Blender under 5.0's too) and in a
# real Blender: the one that BLENDER names, or the provisioned one.
#
#     tests/every_way.sh [--slow] [--only plain|bpy|bpy-next|blender] [options for pytest]
#
# Tests marked "once" do not depend on Blender's version: 4.5's module runs them, the others with --slow, which runs
# the tests marked "slow". An -m of one's own takes the place of both.
# Plain Python and the module of 5.0 have a core of their own beside the other ways; their output comes last.
# A way that cannot be had here is skipped with a line that says why; asked for by --only, it is a failure.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=.venv/bin/python
failed=()
only=
said=$(mktemp -d)
beside=
trap '[ -z "$beside" ] || kill -- "-$beside" 2>/dev/null; rm -rf "$said"' EXIT
any=(-m "not slow")
others=(-m "not slow and not once")
if [ "${1:-}" = --slow ]; then
    any=(-m slow)
    others=(-m "slow or once")
    shift
fi
if [ "${1:-}" = --only ]; then
    only=${2:-}
    [[ $only =~ ^(plain|bpy|bpy-next|blender)$ ]] || { echo "No such way to run the tests: '$only'" >&2; exit 2; }
    shift 2
fi
chosen=$#
blender=${BLENDER:-}
export OMP_WAIT_POLICY=PASSIVE
plain=(env LIQUID_SPLASH_NO_BPY=1 "$python" tests/run.py "${any[@]}")

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

next_version=5.0.1
next_folder=${XDG_CACHE_HOME:-$HOME/.cache}/liquid-splash/bpy-$next_version

find_next_module() {
    # Only the module differs from the way before, so it does not need an environment of its own.
    [ ! -e "$next_folder/.installed" ] || return 0
    # shellcheck disable=SC2086  # PIP_ARGS is a list of words
    "$python" -m pip install ${PIP_ARGS:-} --quiet --no-deps --upgrade --target "$next_folder" "bpy==$next_version" \
        || { skip "bpy $next_version" "The package index does not give it."; return 1; }
    touch "$next_folder/.installed"
}

in_next_module() {
    env PYTHONPATH="$next_folder" "$python" tests/run.py "${others[@]}" tests/blender "$@"
}

begin() {
    # Run a way whose output is shown later, by "report".
    local name=$1 status=0
    "${@:2}" > "$said/$name" 2>&1 || status=$?
    echo "$status" > "$said/$name.status"
}

report() {
    cat "$said/$1"
    return "$(cat "$said/$1.status")"
}

# Provisioning comes first: who starts it should not wait for tests to learn that it fails.
! wanted blender || find_blender
has_next=
! wanted bpy-next || ! find_next_module || has_next=yes
if [ -n "$only" ]; then
    ! wanted plain || run "plain Python" "${plain[@]}" "$@"
    [ -z "$has_next" ] || run "bpy $next_version" in_next_module "$@"
else
    export OMP_NUM_THREADS=1
    set -m # a process group, so that all of it can be stopped
    {
        begin plain "${plain[@]}" "$@"
        [ -z "$has_next" ] || begin next in_next_module "$@"
    } &
    beside=$!
    set +m
fi
! wanted bpy || run "bpy" "$python" tests/run.py "${any[@]}" "$@"
! wanted blender || [ -z "$blender" ] || run "Blender" "$blender" -b --factory-startup --python tests/run.py -- "${others[@]}" "$@"
if [ -z "$only" ]; then
    wait "$beside"
    beside=
    run "plain Python" report plain
    [ -z "$has_next" ] || run "bpy $next_version" report next
fi

printf '\n=== Summary\n'
[ ! -e "$said/summary" ] || cat "$said/summary"
if [ ${#failed[@]} -gt 0 ]; then
    printf 'Failed: %s\n' "${failed[@]}" >&2
    exit 1
fi
