# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that answered one question each; imports evaluation and below."""
