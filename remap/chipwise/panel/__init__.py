# SPDX-License-Identifier: GPL-2.0-or-later
"""The operator's panel: pins with figures of the volumetric feed, and one line at the end of each program."""
