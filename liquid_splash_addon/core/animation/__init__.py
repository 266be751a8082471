# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash as the first moment of an animation: what solvers and other programs start from."""
