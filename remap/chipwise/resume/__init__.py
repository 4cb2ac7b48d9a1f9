# SPDX-License-Identifier: GPL-2.0-or-later
"""Goes on with a program that was interrupted, from the stock that is kept.  Called by cli/resume.py."""
