"""Draw a contour sub with a tool: finish shape, centre path, rough shape, what the tool cannot reach.

The first contour of a sub with several is the boundary of a pocket, the others are its islands
(as for G79); a single one has the tool on its left (41) or right (42), as G77 and G78 take it.
Lengths without a suffix: --tool in the unit of the INI file's machine (mm without one), --at and
what is printed in the unit of the program (its first G20 or G21, else the machine's).
"""

import math
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chipwise import subs
from chipwise.cli import UsageError
from chipwise.cli.load import units_per_mm
from chipwise.errors import MM_PER_INCH, CycleError, format_length, printable
from chipwise.geometry import elements, winding
from chipwise.geometry.contour import ContourError
from chipwise.geometry.offset import LEFT, RIGHT, make_pocket, offset_contour, offset_pocket
from chipwise.geometry.pocket.mixed import offset_mixed
from chipwise.geometry.unreachable import UnreachableRegion
from chipwise.settings import load_settings

NAME = 'contour'
HELP = 'draw a contour sub, the centre path of a tool along it and what it cannot reach'

SUFFIXES = ('.svg', '.png')
RENDERER = 'rsvg-convert'           # Debian: librsvg2-bin
LARGEST_TOOL_MM = 2000.0            # radii to 1 km are tested
PLACES = (12, 60)                   # points each way among which the middle of a region is looked for; then finer


def add_arguments(parser):
    parser.add_argument('program', metavar='PROGRAM', help='G-code file; the sub is looked for as LinuxCNC does')
    parser.add_argument('--sub', required=True, metavar='Q', help='number of the O-sub with the contour')
    parser.add_argument('--tool', required=True, metavar='D', help='diameter: 6 (machine units), 6mm, 0.25in')
    parser.add_argument('--side', choices=('41', '42'), help='tool left (41, default) or right (42) of the contour')
    parser.add_argument('-o', '--output', metavar='FILE', help='picture: FILE.svg or FILE.png')
    parser.add_argument('--ini', metavar='FILE', help='INI file of the machine (default: INI_FILE_NAME, else none)')
    parser.add_argument('--at', nargs=2, type=float, default=(0.0, 0.0), metavar=('X', 'Y'),
                        help='where the tool stands when the sub is called (default: 0 0)')
    parser.add_argument('--set', action='append', default=[], metavar='NAME=VALUE',
                        help='a parameter the program would have set: --set _width=40 --set 100=3')
    parser.error = refuse


def refuse(text):
    """argparse's own complaints in our form."""
    raise UsageError(f'{NAME}: {text}; see chipwise {NAME} --help')


@dataclass(frozen=True, eq=False)
class Drawing:
    """What is printed and drawn, lengths in mm.

    title; unit "mm" or "in" of what is printed; tool (diameter), where: "left", ..; contours: the finish shape;
    result: OffsetResult or MixedResult; places: a point inside of every unreachable region
    """

    title: str
    unit: str
    tool: float
    where: str
    contours: tuple
    result: object
    places: tuple

    @cached_property
    def regions(self):
        return tuple(u for u in self.result.unreachable if isinstance(u, UnreachableRegion))

    @cached_property
    def stretches(self):
        return tuple(u for u in self.result.unreachable if not isinstance(u, UnreachableRegion))


def run(options):
    """-> exit status."""
    try:
        if options.output:
            check_output(options.output)
        drawing = make_drawing(options)
        if options.output:
            write(drawing, options.output)
        print('\n'.join([*report(drawing), *([f'picture: {options.output}'] if options.output else [])]))
    except CycleError as error:
        raise UsageError(f'{NAME}: ' + error.text(error_unit(options)).removeprefix('chipwise: ')) from error
    return 0


# ---- what is asked for ---------------------------------------------------------------------------------------------


def wrong(problem, remedy):
    """CycleError of texts that may hold braces."""
    return CycleError(*(text.replace('{', '{{').replace('}', '}}') for text in (problem, remedy)))


def machine_unit(ini):
    """mm of a machine unit."""
    if not ini:
        return 1.0
    try:
        return 1.0 / units_per_mm(ini)
    except OSError as error:
        raise wrong(f'INI file {ini}: {error.strerror}', 'correct --ini or INI_FILE_NAME') from error
    except (ValueError, ZeroDivisionError) as error:
        raise wrong(f'INI file {ini}: [TRAJ]LINEAR_UNITS is no unit', 'use mm or inch there') from error


def read_program(path):
    """Text of the program."""
    try:
        with open(path, encoding='utf-8', errors='replace') as file:
            return file.read()
    except OSError as error:
        raise wrong(f'{path}: {error.strerror}', 'name a G-code file that can be read') from error


def program_unit(text, unit_mm):
    """"mm" or "in": the first G20 or G21 of a program, else the unit of the machine."""
    for line in text.splitlines():
        code = re.sub(r'\([^)]*\)?|;.*|\s', '', line).upper()
        found = re.search(r'G0*2([01])(?![\d.])', code)
        if found:
            return 'in' if found.group(1) == '0' else 'mm'
    return 'in' if abs(unit_mm - MM_PER_INCH) < 1e-6 else 'mm'


def error_unit(options):
    """Unit of a message, whatever else is wrong."""
    try:
        return program_unit(read_program(options.program), machine_unit(ini_of(options)))
    except CycleError:
        return 'mm'


def ini_of(options):
    return options.ini or os.environ.get('INI_FILE_NAME', '')


def tool_diameter(text, unit_mm):
    """--tool -> mm."""
    match = re.fullmatch(r'\s*([^a-z]+|nan|inf)\s*(mm|in|inch)?\s*', text.lower())
    try:
        value = float(match.group(1)) if match else math.nan
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise wrong(f'--tool {text} is no diameter', 'use a number, with mm or in behind it: 6, 6mm, 0.25in')
    value *= {'mm': 1.0, None: unit_mm}.get(match.group(2), MM_PER_INCH)
    if not 0.0 < value <= LARGEST_TOOL_MM:
        raise wrong(f'--tool {text}: the diameter is not above 0 and up to {LARGEST_TOOL_MM:g} mm',
                    'give the diameter of the tool')
    return value


def sub_number(text):
    match = re.fullmatch(r'[oO]?(\d{1,9})', text.strip())
    if not match:
        raise wrong(f'--sub {text} is no number of an O-sub', 'use --sub 100 for O100 sub')
    return int(match.group(1))


def parameters(given):
    """--set -> (numbered, named) as subs.Job takes them."""
    numbered, named = [], []
    for text in given:
        name, equals, value = text.partition('=')
        name = name.strip().lstrip('#').strip('<>').lower()
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not equals or not math.isfinite(number) or not re.fullmatch(r'[1-9]\d*|_[a-z0-9_-]+', name):
            raise wrong(f'--set {text} sets no parameter', 'use --set _name=value (a global name) or --set 100=value')
        (numbered if name.isdigit() else named).append((int(name) if name.isdigit() else name, number))
    return tuple(sorted(numbered)), tuple(sorted(named))


def make_drawing(options):
    """Drawing of what the options name."""
    text, ini = read_program(options.program), ini_of(options)
    unit_mm = machine_unit(ini)
    tool, unit = tool_diameter(options.tool, unit_mm), program_unit(text, unit_mm)
    numbered, named = parameters(options.set)
    scale = MM_PER_INCH if unit == 'in' else 1.0
    if not all(map(math.isfinite, options.at)):
        raise wrong('--at is no place', 'give two numbers')
    shape = subs.read_shape(subs.Job(
        program=options.program, sub=sub_number(options.sub), ini=ini, unit=unit, machine_unit=unit_mm,
        position=(scale * options.at[0], scale * options.at[1], 0.0), tool=(1, tool / unit_mm), numbered=numbered,
        named=named, close_gap=load_settings(ini)["CLOSE_GAP"]))
    contours = subs.contours(shape)
    result, where = offset(shape, contours, options.side, tool)
    title = printable(f'O{shape.sub} in {os.path.basename(shape.file)}')
    places = tuple(middle(u) for u in result.unreachable if isinstance(u, UnreachableRegion))
    return Drawing(title, unit, tool, where, contours, result, places)


def offset(shape, contours, side, tool):
    """(OffsetResult, where the tool is)."""
    if side and len(contours) > 1:
        raise wrong(f'--side {side} and a sub of {len(contours)} contours: the tool is inside the first and outside of '
                    'the others', 'leave --side out')
    try:
        if len(contours) > 1:
            pocket, where = make_pocket(contours[0], contours[1:]), 'inside, islands outside'
            result = (offset_mixed(pocket, 0.5 * tool) if pocket.mixed
                      else offset_pocket(contours[0], contours[1:], 0.5 * tool))
        else:
            left = side != '42'
            result = offset_contour(contours[0], LEFT if left else RIGHT, 0.5 * tool)
            where = f'{"left" if left else "right"} ({41 if left else 42})' + inside(contours[0], left)
    except ContourError as error:
        raise subs.shape_error(shape, error) from error
    if result.loose:
        raise CycleError(f'sub O{shape.sub}: the centre path has {result.loose} dead ends, which is an error of '
                         'chipwise', 'report it with the program')
    return result, where


def inside(contour, left):
    """Which side of a closed contour that is."""
    if not contour.closed:
        return ''
    return ', inside' if (elements.area(contour.elements) > 0.0) == left else ', outside'


def middle(region):
    """(x, y) mm in a region, as far from its edge as a grid of points tells."""
    e = region.boundary
    low, high = elements.boxes(e)[0].min(axis=0), elements.boxes(e)[1].max(axis=0)
    for places in PLACES:
        grid = np.stack(np.meshgrid(*((np.arange(places) + 0.5) / places,) * 2), axis=-1).reshape(-1, 2)
        point = low + grid * (high - low)
        point = point[winding.numbers(e, point) != 0]
        for hole in region.holes:
            point = point[winding.numbers(hole, point) == 0]
        if len(point):
            edges = elements.join((e, *region.holes))
            gap = np.full(len(point), np.inf)
            for k in range(len(edges)):
                np.minimum(gap, elements.distances(edges, np.full(len(point), k), point), out=gap)
            return tuple(point[int(np.argmax(gap))].tolist())
    longest = int(np.argmax(elements.lengths(e)))       # too slim for any grid: the middle of its longest element
    return tuple(elements.point_at(e, np.array([longest]), np.array([0.5]))[0].tolist())


# ---- what is printed -----------------------------------------------------------------------------------------------


def report(drawing):
    """Lines of text."""
    scale = 1.0 / (MM_PER_INCH if drawing.unit == 'in' else 1.0)
    yield f'{drawing.title}, tool {tool_text(drawing)} {drawing.where}'
    unit = drawing.unit
    yield f'{"":22}{"elements":>9}{"lines":>7}{"arcs":>7}{"length " + unit:>14}{"area " + unit + "2":>16}'
    runs = [('contour' if len(drawing.contours) == 1 else 'boundary' if k == 0 else f'island {k}', c.elements, c.closed)
            for k, c in enumerate(drawing.contours)]
    runs = [(name.replace('contour', 'finish shape'), *rest) for name, *rest in runs]
    for kind, found in (('centre path', drawing.result.paths), ('rough shape', drawing.result.rough)):
        runs += [(f'{kind} {k}' + ('' if run.closed else ', open'), run.elements, run.closed)
                 for k, run in enumerate(found, 1)]
    for name, e, closed in runs:
        yield row(name, e, closed, scale)
    if drawing.result.paths and not drawing.result.rough:
        yield 'contours meet: no rough shape, and the regions are told in chords'
    if not drawing.result.paths:
        yield 'the tool fits nowhere along it'
    yield from unreached(drawing, scale)


def tool_text(drawing):
    return format_length(drawing.tool, drawing.unit)


def row(name, e, closed, scale):
    arcs = int(np.count_nonzero(e.is_arc))
    surface = f'{abs(elements.area(e)) * scale ** 2:16.4f}' if closed and len(e) else f'{"-":>16}'
    return f'{name:22}{len(e):9}{len(e) - arcs:7}{arcs:7}{elements.lengths(e).sum() * scale:14.4f}{surface}'


def unreached(drawing, scale):
    regions, stretches = drawing.regions, drawing.stretches
    total = sum(region.area for region in regions) * scale ** 2
    yield f'unreachable regions: {len(regions)}' + (f', {total:.4f} {drawing.unit}2 together' if regions else '')
    for number, (region, (x, y)) in enumerate(zip(regions, drawing.places), 1):
        size = region.area * scale ** 2
        size = f'{size:.4f}' if size >= 0.01 else f'{size:.3g}'
        yield (f'{number:5}  X{x * scale:.4f} Y{y * scale:.4f}  {size} {drawing.unit}2  '
               f'{lines_text(region.lines)}')
    if stretches:
        yield f'stretches of the contour without a centre path: {len(stretches)}'
    for stretch in stretches:
        x, y = stretch.elements.start[0] * scale
        length = elements.lengths(stretch.elements).sum() * scale
        yield (f'{"":5}  from X{x:.4f} Y{y:.4f}  {length:.4f} {drawing.unit}  '
               f'{lines_text(stretch.lines)}')


def lines_text(numbers):
    """Source lines as "line 12" or "lines 3, 4, 5, .. 90"."""
    numbers = [str(n) for n in numbers]
    if len(numbers) > 12:
        numbers = [*numbers[:11], '.. ' + numbers[-1]]
    return ('line ' if len(numbers) == 1 else 'lines ') + ', '.join(numbers)


# ---- the picture ---------------------------------------------------------------------------------------------------


def check_output(path):
    """CycleError for a picture that cannot be made, before any work."""
    suffix = os.path.splitext(path)[1].lower()
    if suffix not in SUFFIXES:
        raise wrong(f'-o {path}: {suffix or "no suffix"} is no kind of picture made here', 'use .svg or .png')
    folder = os.path.dirname(path) or '.'
    if not os.path.isdir(folder):
        raise wrong(f'-o {path}: there is no folder {folder}', 'make it, or name another one')
    if os.path.isdir(path) or not os.access(path if os.path.exists(path) else folder, os.W_OK):
        raise wrong(f'-o {path} cannot be written', 'name a file in a folder of yours')


def write(drawing, path):
    """Write the picture, whole or not at all."""
    from chipwise.cli.contour_picture import svg
    text = svg(drawing)
    kind = os.path.splitext(path)[1].lower()
    scratch = None
    try:
        with tempfile.NamedTemporaryFile('w', dir=os.path.dirname(path) or '.', prefix='.chipwise-', suffix='.svg',
                                         delete=False) as file:
            scratch = file.name
            file.write(text)
        if kind == '.png':
            render(scratch, scratch + '.png')
            os.replace(scratch + '.png', path)
        else:
            os.chmod(scratch, 0o666 & ~mask())
            os.replace(scratch, path)
    except OSError as error:
        raise wrong(f'-o {path}: {error.strerror}', 'name a file in a folder of yours') from error
    finally:
        for left in (scratch, f'{scratch}.png'):
            if left and os.path.exists(left):
                os.remove(left)


def mask():
    """The process's umask."""
    now = os.umask(0o022)
    os.umask(now)
    return now


def render(source, target):
    """SVG to PNG."""
    try:
        done = subprocess.run([RENDERER, '--format=png', '--zoom=1.5', '-o', target, source],
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=60, check=False)
    except FileNotFoundError as error:
        raise wrong(f'{RENDERER} is not installed, which a .png needs',
                    'make deps, or apt-get install librsvg2-bin, or write an .svg') from error
    except subprocess.TimeoutExpired as error:
        raise wrong(f'{RENDERER} did not end within 60 s', 'write an .svg') from error
    if done.returncode:
        raise wrong(f'{RENDERER}: {" ".join(done.stdout.split())}', 'write an .svg')
