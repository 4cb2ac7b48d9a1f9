# SPDX-License-Identifier: GPL-2.0-or-later
"""Options that the commands and the filter share."""
