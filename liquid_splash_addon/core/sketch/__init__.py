# SPDX-License-Identifier: GPL-3.0-or-later
"""What was drawn: strokes, their speeds and their local frame; imports numeric, fluid and below."""
