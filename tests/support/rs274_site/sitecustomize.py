# SPDX-License-Identifier: GPL-2.0-or-later
"""What the interpreter inside rs274 imports first, where support/forked.py has put this folder on PYTHONPATH."""

import os

import fork_popen

if fork_popen.VARIABLE in os.environ:
    fork_popen.use(int(os.environ.pop(fork_popen.VARIABLE)))
del os.environ["PYTHONPATH"]
