# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the weights. The commands, in order::

python -m training.simulate --scenes N --out DATA     liquid -> frames
python -m training.inspect DATA                       what the data hold
python -m training.train DATA --out RUN               frames -> checkpoints
python -m training.export RUN --data DATA             the add-on's weights
python -m training.evaluate DATA --out FILE           figures on scenes never trained on
"""

import os

# Idle OpenMP threads that spin take the cores from the threads that work, in this process and
# in others: up to ten times slower on a busy machine. It must be said before torch is imported.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
