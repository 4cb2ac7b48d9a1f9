# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures for the user: SVG of contours."""
