# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash moves: simulated from its shape and velocity, frame by frame, or flown on a little."""
