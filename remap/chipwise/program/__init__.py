# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs, as LinuxCNC's interpreter reads them."""
