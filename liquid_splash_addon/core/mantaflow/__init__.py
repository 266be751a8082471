# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash as a frame of the cache of Mantaflow, Blender's own solver, and back."""
