# SPDX-License-Identifier: GPL-2.0-or-later
"""Tools and materials: tables and geometry."""
