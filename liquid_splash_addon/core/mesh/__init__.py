# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of a liquid, and triangle meshes; imports generator and below."""
