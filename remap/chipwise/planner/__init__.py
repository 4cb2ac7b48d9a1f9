# SPDX-License-Identifier: GPL-2.0-or-later
"""The process that plans cycles, and its client."""
