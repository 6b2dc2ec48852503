"""The faults: one operator, comparison, condition or number of an expression, changed."""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}
_UNSEEN = ("__all__", "TYPE_CHECKING", "__name__")
"""Names whose statements say nothing that runs."""


@dataclass(frozen=True)
class Mutation:
    """One fault: a piece of a file and what stands there instead.

    Attributes:
        path: The file, relative to the top of the tree, with forward slashes.
        line: Number of the line in which the piece begins, from 1.
        begin: First byte of the piece in the file.
        end: The byte behind its last.
        before: The piece.
        after: What replaces it.
        row: All of that line, without the space around it.
    """

    path: str
    line: int
    begin: int
    end: int
    before: str
    after: str
    row: str

    def applied(self, source: bytes) -> bytes:
        """Return the file with the fault in it."""
        return source[: self.begin] + self.after.encode() + source[self.end :]

    @property
    def key(self) -> str:
        """What tells it from every other fault, also from the same one on the same line."""
        return f"{self.path}:{self.begin}-{self.end} {_on_one_line(self.after)}"

    def __str__(self) -> str:
        """Return the fault on one line."""
        return f"{self.path}:{self.line}: {_on_one_line(self.before)} -> {_on_one_line(self.after)}"


def _on_one_line(text: str) -> str:
    return " ".join(text.split())


def mutations(path: str, source: bytes) -> list[Mutation]:
    """Return every fault that can be made in a file.

    Text of messages and docstrings, annotations, decorators and `__all__` are left alone: no test
    should have to care for them.
    """
    starts = [0]
    rows = source.splitlines(keepends=True)
    for row in rows:
        starts.append(starts[-1] + len(row))
    found: list[Mutation] = []
    for node in _running(ast.parse(source)):
        if not isinstance(node, ast.expr | ast.stmt) or node.end_lineno is None:
            continue
        begin = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + (node.end_col_offset or 0)
        before = source[begin:end].decode()
        for changed in _changed(node):
            text = ast.unparse(changed)
            after = f"({text})" if isinstance(changed, ast.expr) else text
            row = rows[node.lineno - 1].decode().strip()
            found.append(Mutation(path, node.lineno, begin, end, before, after, row))
    return found


def _running(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below, without annotations, decorators, messages and formatted text."""
    if isinstance(node, ast.JoinedStr | ast.Raise):
        return
    if isinstance(node, ast.Assign | ast.If) and any(
        isinstance(name, ast.Name) and name.id in _UNSEEN
        for top in ([*node.targets] if isinstance(node, ast.Assign) else [node.test])
        for name in ast.walk(top)
    ):
        return
    yield node
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns", "decorator_list", "type_params", "bases"):
            continue
        below: list[object] = value if isinstance(value, list) else [value]
        for child in below:
            if isinstance(child, ast.AST):
                yield from _running(child)


def _changed(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    match node:
        case ast.Compare():
            for index, operator in enumerate(node.ops):
                other = copy.deepcopy(node)
                other.ops[index] = _COMPARISONS[type(operator)]()
                yield other
        case ast.BoolOp():
            other = copy.deepcopy(node)
            other.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
            yield other
        case ast.BinOp() if type(node.op) in _ARITHMETIC and not _is_text(node):
            other = copy.deepcopy(node)
            other.op = _ARITHMETIC[type(node.op)]()
            yield other
        case ast.AugAssign() if type(node.op) in _ARITHMETIC:
            changed = copy.deepcopy(node)
            changed.op = _ARITHMETIC[type(node.op)]()
            yield changed
        case ast.UnaryOp(op=ast.Not() | ast.USub()):
            yield node.operand
        case _:
            yield from _changed_leaf(node)


def _changed_leaf(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    match node:
        case ast.Constant(value=bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(value=int() as number):
            yield ast.Constant(number + 1)
        case ast.Call(func=ast.Name(id=name)) if name in _NAMES:
            other = copy.deepcopy(node)
            other.func = ast.Name(_NAMES[name])
            yield other
        case ast.Break():
            yield ast.Continue()
        case ast.Continue():
            yield ast.Break()
        case _:
            return


def _is_text(node: ast.BinOp) -> bool:
    return any(
        isinstance(part, ast.JoinedStr)
        or (isinstance(part, ast.Constant) and isinstance(part.value, str))
        for part in (node.left, node.right)
    )
