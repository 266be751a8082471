# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes into the extension's zips beside the add-on: wheels, their licences, the index.

targets     for which platforms and Pythons there are zips, and what they contain
lock        which wheels those are, by hash (`make lock`)
wheels      having them on this machine
notices     their licences and the SBOM
blender_tool  Blender's own tool for extensions
"""
