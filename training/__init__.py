# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the weights: simulation, training and measurements; never part of the add-on.

Run as ``python -m training COMMAND`` (see ``__main__``). A room imports only those before it in
this order: scenes, measures, figures, data, simulation, learning, evaluation, research.
"""

import os

# Idle OpenMP threads that spin take the cores from the threads that work, in this process and
# in others: up to ten times slower on a busy machine. To be set before torch is imported.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
