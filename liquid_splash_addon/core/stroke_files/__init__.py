# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of strokes: bytes to drawings and back; imports sketch and below."""
