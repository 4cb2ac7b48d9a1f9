# SPDX-License-Identifier: GPL-2.0-or-later
"""The shared library of the C core, and its structures: all of ctypes."""
