# SPDX-License-Identifier: GPL-3.0-or-later
"""The networks: condition and latent to liquid; imports liquid and below."""
