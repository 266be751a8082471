# SPDX-License-Identifier: GPL-3.0-or-later
"""What is computed beside the interface, and when. Imports scene, data and core."""
