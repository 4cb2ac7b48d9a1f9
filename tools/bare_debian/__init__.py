# SPDX-License-Identifier: GPL-2.0-or-later
"""The parts of tools/on-debian: this machine's apt, the base of a release, the system a command sees."""
