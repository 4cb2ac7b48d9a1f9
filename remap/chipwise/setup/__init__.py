# SPDX-License-Identifier: GPL-2.0-or-later
"""Set up a program as it is: what its tools cut at its own F, a proposal for the feed, and the job file in which a
person confirms both."""
