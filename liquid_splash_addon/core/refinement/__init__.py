# SPDX-License-Identifier: GPL-3.0-or-later
"""Detail that the generator cannot give (paper, 5): from a splash to a finer one.

``level`` is what the steps work on, ``front`` chooses where (eq. 4), ``droplets`` and
``ruptures`` add and remove liquid there, ``waves`` displaces the mesh; ``stack`` is the list of
steps that a user composes.
"""
