# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of frames to play: their names, and what is in them. Imports no library."""

from __future__ import annotations

FILE = "frame_{number:05}.ply"
"""Name of a frame's file, in the language of Python and of Blender's Format String node."""

MANIFEST = "played.json"
"""Says how many there are, and what they were made of: all of one simulation, or each by itself."""

STATE = "played.npz"
"""What the next one goes on from."""

VELOCITY = ("velocity_x", "velocity_y", "velocity_z")
"""Properties of a vertex: Blender's importer makes an attribute of each number, none of vectors."""

RADIUS = "radius"
"""Property of a vertex: that of a drop that is in no mesh, 0 for all other vertices."""
