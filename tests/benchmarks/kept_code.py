# SPDX-License-Identifier: GPL-3.0-or-later
"""To be imported before all that imports numba: compiled code is kept in the folder named last.

That is where an extension's register() says so: numba asks as soon as it is imported.
"""

from __future__ import annotations

import sys
from pathlib import Path

from liquid_splash_addon.core import compiled_code

compiled_code.keep_below(Path(sys.argv[-1]))
assert "numba" not in sys.modules, "numba was imported before it knew of the folder"
