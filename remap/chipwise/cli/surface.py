# SPDX-License-Identifier: GPL-2.0-or-later
"""Make a program that cuts a curved surface, from an STL file or a PNG picture as depth.

The tool goes over the model in parallel cuts, as low as model, floor and holder allow. Lengths are in the unit of the machine, STL
files count as mm. The model stays where its file has it, unless --at or --scale says otherwise; a picture has its lower left corner
at the origin and white at Z0. The stock is taken to fill everything below --stock-top.

Exit status: 0 written, 2 the model, the tool or an option cannot be used; nothing is written then.
"""

import json
import math
import os
import signal
import sys
import time

from chipwise.cli.machine_options import Progress, add_ini, ini_of, refuser
from chipwise.cli.output import is_same_file, unwritable, write_whole
from chipwise.errors import MM_PER_INCH, CycleError, printable

NAME = 'surface'
HELP = 'make a program that cuts a curved surface from STL or a depth picture'

refuse = refuser(NAME)

_LENGTHS = {                # option: (metavar, default in mm or None, smallest, may be the smallest, help)
    'step': ('D', None, 0, False, 'largest step-over'),
    'allowance': ('I', 0.0, 0, True, 'left on the model all over (default: 0)'),
    'clearance': ('R', None, None, True, 'clearance plane (default: 5 mm above model and stock)'),
    'relief': ('K', 1.0, 0, True, 'tool relief at the ends of cuts (default: 1 mm)'),
    'floor': ('Z', None, None, True, 'the tip goes no lower (default: the bottom of the model)'),
    'stock-top': ('Z', None, None, True, 'top of the stock (default: the top of the model)'),
    'margin': ('MM', 0.0, 0, True, "how far the tool's centre goes beyond the model in X and Y (default: 0)"),
    'tolerance': ('MM', 0.01, 0, False, 'how far the path may be above the exact one (default: 0.01 mm)'),
    'pixel': ('MM', None, 0, False, 'size of a pixel (default: as the picture says, else 0.1 mm)'),
    'depth': ('MM', 5.0, 0, False, 'from white to black (default: 5 mm)')}
MOST_MOVES = 20_000_000
LARGEST = 1e5               # of any length option, machine units


def add_arguments(parser):
    parser.add_argument('model', metavar='MODEL', help='STL file, binary or ASCII, or PNG picture with 8 or 16 bit')
    parser.add_argument('-o', '--output', metavar='OUT.ngc', required=True, help='the program')
    parser.add_argument('--tool', type=int, metavar='N', required=True, help='number of the tool in the tool table')
    for name, (metavar, _default, _least, _closed, text) in _LENGTHS.items():
        parser.add_argument(f'--{name}', type=float, metavar=metavar, required=name == 'step', help=text)
    parser.add_argument('--direction', type=int, metavar='DEG', default=0, help='of the cuts, whole degrees to X (default: 0)')
    parser.add_argument('--link', type=int, metavar='0|1|2', default=0,
                        help='0 over the clearance plane (default), 1 the lowest safe link, 2 zigzag')
    parser.add_argument('--conventional', action='store_true', help='one-way cuts are conventional, not climb, with M3')
    parser.add_argument('--at', nargs=3, type=float, metavar=('X', 'Y', 'Z'), default=(0.0, 0.0, 0.0), help="where the file's origin goes")
    parser.add_argument('--scale', type=float, default=1.0, metavar='S', help="factor of the file's lengths (default: 1)")
    parser.add_argument('--feed', type=float, metavar='F', help='cutting feed, machine units/min (default: 600 mm/min)')
    parser.add_argument('--plunge-feed', type=float, metavar='E', help='plunge feed (default: half of --feed)')
    parser.add_argument('--speed', type=float, metavar='S', default=10000.0, help='spindle speed (default: 10000)')
    parser.add_argument('--json', metavar='FILE', help='the figures, for programs')
    add_ini(parser)
    parser.error = refuse


def run(options):
    """-> exit status."""
    check_options(options)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    progress, began = Progress(sys.stderr), time.monotonic()
    try:
        request, unit_mm = request_of(options)
        from chipwise.cycles.surface import surface_plan
        plan = surface_plan(request, progress)
        text = program_text(options, request, plan, unit_mm)
        write_whole(options.output, text)
    except CycleError as error:
        progress.clear()
        print(printable(error.text(unit_of(options)).replace('chipwise: ', f'chipwise: {NAME}: ', 1)), file=sys.stderr)
        return 2
    except MemoryError:
        progress.clear()
        print(f'chipwise: {NAME}: the memory is not enough for this model; export it with a larger tolerance', file=sys.stderr)
        return 2
    progress.end()
    figures = figures_of(request, plan, time.monotonic() - began)
    for note in plan.notes:
        print(printable(CycleError(note.text, **note.lengths).text(unit_of(options))))
    print(printable(f'{options.output}: {figures["cuts"]} cuts, {figures["moves"]} moves from {figures["sampled"]} points'))
    if options.json:
        write_whole(options.json, json.dumps({'output': options.output, **figures}, indent=1) + '\n')
    return 0


def check_options(options):
    """UsageError for what cannot be meant."""
    for name, (_metavar, _default, least, closed, _text) in _LENGTHS.items():
        value = getattr(options, name.replace('-', '_'))
        if value is None:
            continue
        low = -LARGEST if least is None else least
        if not (low < value <= LARGEST or closed and value == low):
            refuse(f'--{name} {value:g} is not {"a length" if least is None else "a length of 0 or more" if closed else "a length above 0"}')
    for name in ('feed', 'plunge_feed', 'speed', 'scale'):
        value = getattr(options, name)
        if value is not None and not 0 < value < 1e6:
            refuse(f'--{name.replace("_", "-")} {value:g} is not a number above 0')
    if not all(abs(value) <= LARGEST for value in options.at):
        refuse('--at needs three lengths')
    if options.tool < 1:
        refuse(f'--tool {options.tool} is not the number of a tool')
    for path in filter(None, (options.output, options.json)):
        if unwritable(path):
            refuse('; '.join(unwritable(path)))
        if is_same_file(path, options.model):
            refuse(f'{path} is the model itself')


def unit_of(options):
    """"mm" or "in": of the machine, whatever else is wrong."""
    from chipwise.ini import Ini
    try:
        return 'in' if abs(1.0 / Ini(ini_of(options)).units_per_mm() - MM_PER_INCH) < 1e-6 else 'mm'
    except CycleError:
        return 'mm'


def request_of(options):
    """(SurfaceRequest, mm of a machine unit)"""
    from chipwise.check.reader import Machine, Unreadable
    from chipwise.check.sweep import Shape
    from chipwise.cycles.surface import SurfaceRequest
    from chipwise.settings import load_settings
    from chipwise.surface.model import Placing
    from chipwise.tool_table import diameter_of
    from chipwise.tools import ToolGeometry, tool_geometry
    try:
        machine = Machine(ini_of(options))
    except Unreadable as error:
        refuse(str(error).partition('; see')[0])
    settings, unit = load_settings(machine.ini), machine.unit_mm
    geometry = tool_geometry(settings.path('TOOL_GEOMETRY'), options.tool) or ToolGeometry()
    lengths = {}
    for name, (_metavar, default, *_rest) in _LENGTHS.items():
        value = getattr(options, name.replace('-', '_'))
        lengths[name] = default if value is None else value * unit
    feed = 600.0 if options.feed is None else options.feed * unit
    placing = Placing(tuple(value * unit for value in options.at), options.scale, lengths['pixel'], lengths['depth'])
    return SurfaceRequest(
        file=options.model, stamp=(), placing=placing, bottom=lengths['floor'], clearance=lengths['clearance'],
        tool=Shape.of_tool(diameter_of(machine.table, options.tool) * unit, geometry), step=lengths['step'], feed=feed,
        plunge_feed=feed / 2 if options.plunge_feed is None else options.plunge_feed * unit, start=None,
        direction=float(options.direction), allowance=lengths['allowance'], relief=lengths['relief'], link=options.link,
        climb=not options.conventional, tolerance=lengths['tolerance'], stock_top=lengths['stock-top'], stock_is_model=True,
        cell=settings['CELL'], margin=lengths['margin'], most_moves=MOST_MOVES), unit


def program_text(options, request, plan, unit_mm):
    """The program."""
    from chipwise.lines import texts
    inch = unit_mm > 10
    size = ' '.join(f'{axis}{low / unit_mm:.3f}..{high / unit_mm:.3f}' for axis, low, high in zip('XYZ', plan.low, plan.high))
    name = ''.join(c if c.isprintable() and c not in '()' else '_' for c in os.path.basename(options.model).encode('ascii', 'replace').decode())
    lines = [f'(chipwise surface: {name}, {size})',
             f'(tool {options.tool}, step-over {request.step / unit_mm:.4g}, direction {options.direction}, link {options.link})',
             f'{"G20" if inch else "G21"} G17 G40 G49 G54 G80 G90 G91.1 G94', f'G64 P{0.2 * request.tolerance / unit_mm:.6f}',
             f'T{options.tool} M6', 'G43', f'S{options.speed:g} M3', f'G0 Z{plan.clearance / unit_mm:.4f}',
             'G0 X{:.5f} Y{:.5f}'.format(*(value / unit_mm for value in plan.first))]
    lines += texts(plan.moves, (*plan.first, plan.clearance), unit_mm, 5 if inch else 4)
    return '\n'.join([*lines, 'M5', 'M2', ''])


def figures_of(request, plan, seconds):
    """What was made: lengths in mm."""
    from chipwise.moves import Line, Rapid
    at, feed_mm, rapid_mm = (*plan.first, plan.clearance), 0.0, 0.0
    for move in plan.moves:
        new = tuple(old if value is None else value for old, value in zip(at, (move.x, move.y, move.z)))
        length = math.dist(at, new)
        feed_mm, rapid_mm = feed_mm + length * isinstance(move, Line), rapid_mm + length * isinstance(move, Rapid)
        at = new
    return {'cuts': plan.cuts, 'sampled': plan.sampled, 'moves': len(plan.moves), 'feed_mm': round(feed_mm, 3), 'rapid_mm': round(rapid_mm, 3),
            'low': [round(v, 6) for v in plan.low], 'high': [round(v, 6) for v in plan.high], 'clearance': plan.clearance,
            'tolerance': request.tolerance, 'seconds': round(seconds, 3), 'notes': [CycleError(n.text, **n.lengths).text() for n in plan.notes]}
