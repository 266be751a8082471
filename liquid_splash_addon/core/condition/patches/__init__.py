# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets that strokes suggest: triangles of the Gabriel complex, curved (PN triangles)."""
