#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Provision a real Blender, from Debian sid, in a folder of its own that leaves the system as it is.
#
# Exit status: 0 it is there; 2 it cannot be had here (the last line says why); anything else is a mistake of ours.
# Environment: PIP is the pip command to use, PIP_ARGS its extra options.
set -euo pipefail

system_packages=(
    blender python3-torch python3-safetensors python3-skimage python3-scipy
    xvfb xauth x11-utils xdotool imagemagick
    libgl1-mesa-dri libegl1 libglx-mesa0 libopengl0 mesa-vulkan-drivers libvulkan1
)
# What some tests can use and Blender can do without: virtual reality with no headset, and reading OpenVDB files.
optional_packages=(
    monado-service libopenxr1-monado libopenxr-loader1 monado-cli python3-openvdb
)
# Not Debian packages, or too old there. numpy must stay Debian's: Blender is built with that one.
python_packages=(
    cattrs attrs typing_extensions pymeshlab numba llvmlite tqdm tensorboard absl-py protobuf
    pytest pluggy iniconfig packaging pygments
)

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
folder=${XDG_CACHE_HOME:-${HOME:-/root}/.cache}/liquid-splash
root=$folder/blender-root
building=$folder/blender-root.building
log=$folder/provision.log
read -r -a pip <<< "${PIP:-python3 -m pip}"
read -r -a pip_args <<< "${PIP_ARGS:-}"
wanted=$(printf '%s\n' "${system_packages[@]}" -- "${optional_packages[@]}" -- "${python_packages[@]}" \
    | sha256sum | cut -d' ' -f1)

unavailable() {
    echo "A real Blender cannot be provisioned: $1. BLENDER=/path/to/blender uses your own." >&2
    exit 2
}

step() {
    echo "blender: $1 (log: $log)"
}

inside() {
    LIQUID_SPLASH_BLENDER_ROOT=$building "$here/blender_root.sh" "$@"
}

is_ready() {
    [ "$(cat "$root/.liquid-splash" 2>/dev/null)" = "$wanted" ]
}

debian_mirror() {
    # The system's own first archive; apt understands every form of its source lists, so ask it.
    apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2>/dev/null | grep -v -m1 security
}

require_debootstrap() {
    command -v debootstrap >/dev/null && return
    { apt-get update && apt-get install --yes --no-install-recommends debootstrap; } >>"$log" 2>&1 \
        || unavailable "debootstrap is not installed and cannot be"
}

make_system() {
    step "downloading a minimal Debian system"
    # Its own mount namespace: debootstrap mounts /proc in there.
    setpriv --pdeathsig KILL unshare --mount --pid --fork --kill-child \
        debootstrap --variant=minbase sid "$building" "$1" >>"$log" 2>&1 \
        || unavailable "debootstrap of Debian sid failed, see $log"
    cp -L /etc/resolv.conf "$building/etc/resolv.conf"
    # The system's proxies and the like, not its hooks, which name programs that are missing inside.
    apt-config dump | grep -E '^Acquire::(https?|Check|Retries|Languages)' \
        >"$building/etc/apt/apt.conf.d/90host" || true
    printf '%s\n' force-unsafe-io 'path-exclude=/usr/share/doc/*' 'path-exclude=/usr/share/man/*' \
        >"$building/etc/dpkg/dpkg.cfg.d/90lean"
    # No package may start a service.
    printf '#!/bin/sh\nexit 101\n' >"$building/usr/sbin/policy-rc.d"
    chmod +x "$building/usr/sbin/policy-rc.d"
}

install_debian() {
    inside env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends "$@" >>"$log" 2>&1
}

install_optional() {
    # All at once is fast; one at a time finds those that can be had.
    install_debian "${optional_packages[@]}" && return
    local package missing=()
    for package in "${optional_packages[@]}"; do
        install_debian "$package" || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] || step "going on without optional packages that could not be had: ${missing[*]}"
}

install_packages() {
    step "installing Blender and its libraries, about 4 GB"
    { inside apt-get update >>"$log" 2>&1 && install_debian "${system_packages[@]}"; } \
        || unavailable "the Debian mirror did not give its packages, see $log"
    install_optional
    inside apt-get clean
    local version
    version=$(inside python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    "${pip[@]}" install ${pip_args[@]+"${pip_args[@]}"} --quiet --no-deps --only-binary=:all: \
        --python-version "$version" --target "$building/usr/local/lib/python$version/dist-packages" \
        "${python_packages[@]}" >>"$log" 2>&1 \
        || unavailable "the package index has no Python packages for its Python $version, see $log"
    inside blender --background --python-exit-code 1 \
        --python-expr 'import torch, skimage, safetensors, numba, pymeshlab, tensorboard, pytest, cattrs' >>"$log" 2>&1 \
        || unavailable "Blender was installed but does not start with its libraries, see $log"
}

main() {
    # Running it needs these two as much as making it.
    [ "$(id -u)" = 0 ] || unavailable "that needs root"
    unshare --mount true 2>/dev/null || unavailable "this system allows no mounts, not even private ones"
    if is_ready; then
        return
    fi
    command -v apt-get >/dev/null || unavailable "that needs a Debian-like system"
    mkdir -p "$folder"
    exec 9>"$folder/lock"
    flock 9
    is_ready && return
    : >"$log"
    local mirror
    mirror=$(debian_mirror) || unavailable "the system names no Debian mirror"
    require_debootstrap
    rm -rf --one-file-system "$building"
    make_system "$mirror"
    install_packages
    # Only a finished root gets this name, so an interrupted run leaves nothing that looks usable.
    echo "$wanted" >"$building/.liquid-splash"
    rm -rf --one-file-system "$root"
    mv "$building" "$root"
    step "ready"
}

main
