"""Whether LinuxCNC's interpreter will find chipwise's codes: the [PYTHON] section of the INI file.

Called by load.py while LinuxCNC starts.  LinuxCNC reads the first [PYTHON] section only, and looks every code up in the
module `remap` that TOPLEVEL imports.  Without this check the first that is heard of a machine whose `remap` is another
one is an error of the interpreter which names neither.
"""

import glob
import os
import re

from chipwise.errors import CycleError
from chipwise.settings import braceless, ini_file_name

CODES = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))     # the folder remap/
IMPORT = 'from chipwise.codes import *'
OURS = re.compile(r'^\s*REMAP\s*=.*\bpython\s*=\s*m250\b', re.IGNORECASE)


def first_section(lines, name):
    """INI lines -> [(KEY, text)] of the first section of that name; None where there is none."""
    found, inside = None, False
    for line in lines:
        line = line.strip()
        if line.startswith('['):
            if found is not None:
                break
            inside = line[1:].partition(']')[0].strip().upper() == name
            found = [] if inside else None
        elif inside and line and line[0] not in '#;' and '=' in line:
            key, _equals, text = line.partition('=')
            found.append((key.strip().upper(), text.partition(' #')[0].strip()))
    return found


def check_codes(path=None):
    """Raise CycleError for an INI file that remaps chipwise's codes and whose [PYTHON] section cannot find them."""
    path = path or ini_file_name()
    try:
        with open(path, encoding='utf-8', errors='replace') as ini:
            lines = ini.readlines()
    except OSError as error:
        raise CycleError(f'INI file {braceless(path)}: {error.strerror}', 'correct INI_FILE_NAME') from error
    if not any(OURS.match(line) for line in lines):
        return
    section = first_section(lines, 'PYTHON')
    if section is None:
        raise CycleError('this INI file remaps chipwise\'s codes and has no [PYTHON] section',
                         'add the third of README\'s lines, #INCLUDE .../chipwise.inc, at its end')
    folder = os.path.dirname(os.path.abspath(path))
    top = next((text for key, text in section if key == 'TOPLEVEL'), '')
    top = os.path.join(folder, os.path.expanduser(top))
    if os.path.realpath(os.path.dirname(top)) == CODES:
        return
    places = [os.path.join(folder, os.path.expanduser(text)) for key, text in section if key in ('PATH_PREPEND', 'PATH_APPEND')]
    if not (any(os.path.realpath(place) == CODES for place in places)
            and knows_the_codes([os.path.dirname(top), *places])):
        raise CycleError('this INI file has a [PYTHON] section of its own, which does not know chipwise\'s codes',
                         f'add the line PATH_APPEND = {braceless(CODES)} to it, and the line `{IMPORT}` to its module '
                         'remap (remap.py)')


def knows_the_codes(places):
    """Whether a Python file in one of the folders, beside chipwise's own, imports the codes."""
    for place in places:
        if os.path.realpath(place) == CODES:
            continue
        for name in glob.glob(os.path.join(glob.escape(place), '*.py')):
            try:
                with open(name, encoding='utf-8', errors='replace') as handle:
                    if re.search(r'^\s*(from|import)\s+chipwise\b', handle.read(), re.MULTILINE):
                        return True
            except OSError:
                continue
    return False
