# SPDX-License-Identifier: GPL-3.0-or-later
"""A sketch on a grid, as the generator is shown it; imports sketch and below."""
