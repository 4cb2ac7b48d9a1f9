# SPDX-License-Identifier: GPL-2.0-or-later
"""The messages of the source: what an operator can get from chipwise, read from its Python and C.

Used by tools/messages.py.  Nothing is imported: Python is read as its syntax tree, C as text.

 1. A message is an argument of one of the calls in SPEAKERS, an entry of one of the tables in TABLES, or the result of
    one of the functions in TEXTS.  A name there that no longer exists in the source is an error.
 2. Whatever is filled in at run time becomes "..": {names}, f-string expressions, %d.
 3. Strings that a local variable, a module constant or an `a if c else b` chooses from give one message each.
 4. A message is a fact and a remedy: two arguments, or the text before and after the first "; ".
"""

import ast
import itertools
import os
import re

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))

# Calls that say something: {name: positions of fact and remedy}.  Exceptions by their class, the others by their name.
SPEAKERS = {
    "CycleError": (0, 1),
    "NoRoom": (0, 1),
    "FolderError": (0, 1),
    "EntryError": (2, 3),
    "_Wrong": (0, 1),
    "Unreadable": (0, 1),
    "Missing": (0, 1),
    "lacks": (0, 1),
    "Unusable": (0, 1),
    "Lacking": (0, 1),
    "Unfinished": (0, 1),
    "note": (0,),
    "not_opened": (0,),
    "unchecked": (0,),
    "unfinished": (0,),
    "wrong": (0, 1),
    "refuse": (0, 1),
    "_fail": (2, 3),
    "fault": (1, 2),
    "_refuse": (1,),
    "ContourError": (2,),
    "StoreError": (1,),
    "CommandError": (0,),
    "UsageError": (0,),
    "ClusterError": (0,),
    "_Failed": (0,),
    "SessionError": (0,),
    "RunError": (0,),
    "SharedStockError": (0,),
    "CoreError": (0,),
    "LibraryError": (0,),
    "Rs274Error": (0,),
    "SystemExit": (0,),
    "say": (0,),
    "inform": (0,),
    "tell": (0,),
    "MESSAGE": (0,),
    "error": (0,),
    "print": (0,),
}
LOUD = {"print", "error", "SystemExit"}  # these count only if the text begins with the name of a command
TABLES = ("FAULTS", "REASONS", "PATH_REFUSALS", "LOAD_ALARMS")  # {number: text} or {number: (fact, remedy)}
TEXTS = (
    "guard_text",
    "clamp_text",
    "slow_text",
    "override_text",
    "message_of",
    "of_unexpected",
    "forgetful",
    "running",
    "_rate_note",
)  # functions that return a message
NOTES = re.compile(r"note")  # functions that make (text, values)
FINDING = "said"  # the variable of Finding.said(), and of the methods that it shares it with:
OF_FINDING = ("said", "_said_of_load", "_said_of_machine")


# ---- strings of an expression ------------------------------------------------------------------------------------


class Scope:
    """Values of string names at a line: assignments of the module, and those of the function before the line.

    An assignment that is not nested deeper than the ones before it replaces them.
    """

    def __init__(self, module, function, line):
        self.values = {}
        for node in module.body:
            self._assignment(node)
        inside = [] if function is None else [node for node in ast.walk(function) if isinstance(node, ast.Assign)]
        for node in sorted(inside, key=lambda node: node.lineno):
            if node.lineno < line:
                self._assignment(node)

    def add_parameters(self, module):
        """What Finding.said() hands to its helpers by the same names."""
        said = next(
            node for node in ast.walk(module) if isinstance(node, ast.FunctionDef) and node.name == OF_FINDING[0]
        )
        for node in said.body:
            self._assignment(node)

    def _assignment(self, node):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                self._bind(target, node.value, node.col_offset)

    def _bind(self, target, value, depth):
        if isinstance(target, ast.Name):
            kept = [(d, v) for d, v in self.values.get(target.id, ()) if depth > d or depth == d and depth > 8]
            self.values[target.id] = kept + [(depth, value)]
        elif isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for one, other in zip(target.elts, value.elts):
                self._bind(one, other, depth)


def texts(node, scope, depth=0):
    """Every text an expression may give, with ".." for what is known at run time only."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) else [".."]
    if isinstance(node, ast.JoinedStr):
        return _products([texts(part, scope, depth) for part in node.values])
    if isinstance(node, ast.FormattedValue):
        return _embedded(texts(node.value, scope, depth + 1))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        whole = (ast.BinOp, ast.JoinedStr, ast.Constant)
        return _products(
            [
                texts(part, scope, depth) if isinstance(part, whole) else _embedded(texts(part, scope, depth + 1))
                for part in (node.left, node.right)
            ]
        )
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod):
        return [
            re.sub(r"%(?:\(\w+\))?[-+#0 ]*[\d.*]*[sdgfxr]", "..", text).replace("%%", "%")
            for text in texts(node.left, scope, depth)
        ]
    if isinstance(node, ast.IfExp):
        return texts(node.body, scope, depth) + texts(node.orelse, scope, depth)
    if isinstance(node, ast.Name) and depth < 4 and node.id in scope.values:
        return list(
            dict.fromkeys(
                text
                for _depth, value in scope.values[node.id]
                if not (isinstance(value, ast.Constant) and value.value is None)
                for text in texts(value, scope, depth + 1)
            )
        )
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "printable":
        return texts(node.args[0], scope, depth)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        if node.func.attr in ("removeprefix", "rstrip", "strip"):
            return texts(node.func.value, scope, depth)
        if node.func.attr == "format":
            return [re.sub(r"\{[^}]*\}", "..", text) for text in texts(node.func.value, scope, depth)]
        if node.func.attr == "get" and len(node.args) == 2:
            return texts(node.args[1], scope, depth)
    return [".."]


def _embedded(found):
    """Texts inside a text: an ending of a word is chosen at its longest, anything without a blank is a value."""
    if all(len(text) <= 3 for text in found):
        return [max(found, key=len)] if len(found) > 1 else [".."]
    return found if any(" " in text.strip() for text in found) and len(found) <= 4 else [".."]


def _products(parts):
    return ["".join(choice) for choice in itertools.islice(itertools.product(*parts), 16)]


def normal(text):
    """A template with its placeholders as "..", on one line, without our name in front."""
    text = re.sub(r"\{\w*(?:[!:][^}]*)?\}", "..", text.replace("{{", "{").replace("}}", "}"))
    text = re.sub(r"\s+", " ", text).strip()
    text = re.sub(r"^(?:\.\. )?chipwise: ", "", text)
    return re.sub(r"(?:\.\.){2,}", "..", text)


def split(text):
    """-> (fact, remedy) of a text that holds both."""
    depth = 0
    for k, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth == 0 and text.startswith("; ", k):
            return text[:k], text[k + 2 :]
    return text, ""


def is_message(fact):
    return len(re.findall(r"[A-Za-z]{2,}", fact)) >= 2 or (".." in fact and len(re.findall(r"[A-Za-z]{3,}", fact)) >= 2)


# ---- Python ------------------------------------------------------------------------------------------------------


def python_messages(path, used):
    """[(fact, remedy)] of a Python file; names of SPEAKERS, TABLES and TEXTS that occur in it are added to `used`."""
    with open(os.path.join(ROOT, path), encoding="utf-8") as handle:
        module = ast.parse(handle.read(), path)
    found = []
    parents = {child: node for node in ast.walk(module) for child in ast.iter_child_nodes(node)}

    def function_of(node):
        while node is not None and not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            node = parents.get(node)
        return node

    for node in ast.walk(module):
        if not isinstance(node, (ast.Call, ast.Assign, ast.AnnAssign, ast.Return, ast.Tuple)):
            continue
        if isinstance(node, ast.Call) and _name(node) not in {*SPEAKERS, "Note", "__init__"}:
            continue
        function = function_of(node)
        if isinstance(node, (ast.Return, ast.Tuple)) and (
            function is None or function.name not in TEXTS and not NOTES.search(function.name)
        ):
            continue
        if (
            isinstance(node, (ast.Assign, ast.AnnAssign))
            and function is not None
            and function.name not in ("text", *OF_FINDING)
        ):
            continue
        scope = Scope(module, function, getattr(node, "end_lineno", 0) or 0)
        if function is not None and function.name in OF_FINDING[1:]:
            scope.add_parameters(module)
        if isinstance(node, ast.Call):
            found += _of_call(node, scope, used, parents)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            found += _of_assignment(node, scope, function, used)
        elif isinstance(node, ast.Return) and function is not None and node.value is not None:
            if function.name in TEXTS:
                used.add(function.name)
                found += [split(normal(text)) for text in texts(node.value, scope)]
        elif isinstance(node, ast.Tuple) and function is not None and NOTES.search(function.name):
            if len(node.elts) == 2 and isinstance(node.elts[1], ast.Dict):
                found += [split(normal(text)) for text in texts(node.elts[0], scope)]
    return [(fact, remedy) for fact, remedy in found if is_message(fact)]


def _name(call):
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _of_call(node, scope, used, parents):
    name = _name(node)
    if name == "__init__" and isinstance(parents.get(node), ast.Expr):  # super().__init__(errno, text, path)
        return [split(normal(text)) for argument in node.args[1:2] for text in texts(argument, scope)]
    if name == "Note" and node.args:
        return [split(normal(text)) for text in texts(node.args[0], scope)]
    places = SPEAKERS.get(name)
    if places is None:
        return []
    used.add(name)
    keywords = {keyword.arg: keyword.value for keyword in node.keywords}
    arguments = [
        node.args[place] if len(node.args) > place else keywords.get(("problem", "remedy")[k])
        for k, place in enumerate(places)
    ]
    if arguments[0] is None or any(isinstance(argument, ast.Starred) for argument in node.args[:1]):
        return []
    facts = texts(arguments[0], scope)
    if name in LOUD:
        facts = [text for text in facts if re.match(r"chipwise|no private", text)]
    remedies = texts(arguments[1], scope) if len(arguments) > 1 and arguments[1] is not None else [""]
    remedies = list(dict.fromkeys(remedies))
    if len(facts) == len(remedies):
        pairs = list(zip(facts, remedies))
    else:
        pairs = list(itertools.product(facts, remedies))
    return [(normal(fact), normal(remedy)) if remedy else split(normal(fact)) for fact, remedy in pairs]


def _of_assignment(node, scope, function, used):
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    names = [target.id for target in targets if isinstance(target, ast.Name)]
    if not names or node.value is None:
        return []
    if function is None and names[0] in TABLES and isinstance(node.value, ast.Dict):
        used.add(names[0])
        found = []
        for value in node.value.values:
            pair = value.elts if isinstance(value, ast.Tuple) else [value]
            said = [normal(texts(part, scope)[0]) for part in pair]
            found.append(tuple(said[:2]) if len(said) > 1 else split(said[0]))
        return found
    if names[0] == FINDING and function is not None and function.name in OF_FINDING:
        used.add(FINDING)
        return [split(normal(text)) for text in texts(node.value, scope)]
    return []


# ---- C -----------------------------------------------------------------------------------------------------------

_PRINTED = re.compile(r'rtapi_print_msg\s*\(\s*\w+\s*,\s*((?:"(?:[^"\\]|\\.)*"\s*)+)')


def c_messages(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as handle:
        source = handle.read()
    found = []
    for match in _PRINTED.finditer(source):
        text = "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', match[1])).replace("\\n", " ").replace('\\"', '"')
        found.append(split(normal(re.sub(r"%[-+0-9.]*(?:l|z)*[sdugfx]", "..", text))))
    return found


# ---- all of it ---------------------------------------------------------------------------------------------------


def sources():
    """Paths of every source file that can say something, relative to the repository."""
    found = []
    for top in ("remap", "bin", "components"):
        for folder, folders, names in os.walk(os.path.join(ROOT, top)):
            folders[:] = [name for name in folders if name != "__pycache__"]
            for name in names:
                path = os.path.join(folder, name)
                if os.path.islink(path):
                    continue
                if name.endswith((".py", ".comp", ".c", ".h")) or top == "bin" and _is_python(path):
                    found.append(os.path.relpath(path, ROOT))
    return sorted(found)


def _is_python(path):
    with open(path, "rb") as handle:
        return b"python" in handle.readline()


def messages():
    """{(fact, remedy): [paths]}; LookupError for a name of SPEAKERS, TABLES or TEXTS that is not in the source."""
    found, used = {}, set()
    for path in sources():
        if path.endswith((".comp", ".c", ".h")):
            said = c_messages(path)
        else:
            said = python_messages(path, used)
        for pair in said:
            paths = found.setdefault(pair, [])
            if path not in paths:
                paths.append(path)
    gone = {*SPEAKERS, *TABLES, *TEXTS, FINDING} - used
    if gone:
        raise LookupError(f"tools/message_source.py: not in the source any more: {', '.join(sorted(gone))}")
    return found
