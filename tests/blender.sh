#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The provisioned real Blender as a drop-in for a Blender binary: BLENDER=tests/blender.sh make test
set -euo pipefail
exec "$(dirname "${BASH_SOURCE[0]}")/blender_root.sh" blender "$@"
