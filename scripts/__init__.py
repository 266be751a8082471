# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs that are run by make, or by hand."""
