# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of liquids without Blender; imports scenes, measures and core."""
