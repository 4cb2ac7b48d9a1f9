# SPDX-License-Identifier: GPL-2.0-or-later
"""What a program that names no stock or no tool is likely to be meant for: from its comments (post_comments.py) and its path (survey.py)."""
