# SPDX-License-Identifier: GPL-3.0-or-later
"""What a .blend file remembers: properties and their registration. Imports core alone."""
