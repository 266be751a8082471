# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing with tracked hands, in virtual reality. Imports jobs, scene, data and core."""
