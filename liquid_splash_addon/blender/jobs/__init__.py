# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs beside the interface; imports scene, data and core."""
