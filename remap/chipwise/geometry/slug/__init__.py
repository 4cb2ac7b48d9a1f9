# SPDX-License-Identifier: GPL-2.0-or-later
"""Chopping a slug: which straight lines, in which order."""
