"""The language of rules: a part of Python that means the same in Python and in kernels.

All numbers are 64-bit floating-point numbers, whole numbers too. A rule computes with + - * / // %,
comparisons, `and`, `or`, `not`, conditional expressions, and `exp`, `log`, `power`, `pick`, `min`,
`max` and `abs`. Statements are assignments, `if`, and `for` over a `range` of literal numbers.
The only `return` is the last line. So a rule always ends, and reads nothing but its arguments.

A list, `[a, b]` or `[... for k in range(3)]`, is a vector like the inputs with several entries.
Vectors never change: a name is assigned lists of one length only, and entries are not assigned.

`kernel_source` translates a rule into source text for Taichi. Python types a variable at each
assignment, Taichi at the first one; the translation removes this and other differences.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import reduce
from textwrap import dedent
from typing import Any, NoReturn

# Numbers of arguments; the first argument of `pick` is a vector.
FUNCTIONS = {"exp": 1, "log": 1, "power": 2, "pick": 2, "min": 2, "max": 2, "abs": 1}
_MOST_REPEATS = 256  # of the body of the innermost loop
_OPERATORS: dict[type, str] = {ast.Add: "{} + {}", ast.Sub: "{} - {}", ast.Mult: "{} * {}"}
_OPERATORS |= {ast.Div: "{} / {}", ast.FloorDiv: "ti.floor({} / {})", ast.Mod: "modulo({}, {})"}
_OPERATORS |= {ast.USub: "-{}", ast.UAdd: "{}"}
_COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "=="}
_COMPARISONS |= {ast.NotEq: "!="}
_CONDITION = "is not a number; use it as a condition, as in `1 if a and b else 0`"
_INSTEAD: dict[type, str] = dict.fromkeys((ast.And, ast.Or, ast.Not), _CONDITION)
_INSTEAD[ast.Pow] = "is not allowed; write power(x, y), of taichi_ants.rules"


class LanguageError(ValueError):
    """The reason why a function is not a rule, with the line in the function, from 1."""


def kernel_source(function: Callable[..., Any], lengths: Mapping[str, int]) -> str:
    """Return the source of a Taichi function `rule` that does the same as a function.

    `lengths` has all arguments in order: 0 for a number, else the length of a vector. Raises
    LanguageError if the function contains anything else than the module's docstring describes.
    """
    try:
        (tree,) = ast.parse(dedent(inspect.getsource(function))).body
    except (OSError, SyntaxError, TypeError, ValueError) as error:
        raise LanguageError("its source cannot be read; define it with def, in a file") from error
    if not isinstance(tree, ast.FunctionDef):
        raise LanguageError("it must be a function that is defined with def")
    return _Translation(function, tree, lengths).source()


class _Translation:
    """The translation of one function; names of the rule begin with `u_` in the result."""

    def __init__(
        self, function: Callable[..., Any], tree: ast.FunctionDef, lengths: Mapping[str, int]
    ) -> None:
        closure = inspect.getclosurevars(function)
        # Python before 3.12 does not list the globals that only a list names.
        self._outside = {**closure.builtins, **function.__globals__, **closure.nonlocals}
        self._tree, self._arguments, self._lengths = tree, lengths, dict(lengths)
        self._first_line = tree.lineno - len(tree.decorator_list)
        self._loops: list[tuple[str, int]] = []  # variables and repetitions of the present loops
        assigned = []
        self._vectors, self._loop_variables = set[str](), set[str]()
        for node in ast.walk(tree):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                assigned.append(node.id)
            elif isinstance(node, ast.Assign) and isinstance(node.value, (ast.List, ast.ListComp)):
                self._vectors.add(ast.unparse(node.targets[0]))
            elif isinstance(node, (ast.For, ast.comprehension)):
                self._loop_variables.add(ast.unparse(node.target))
        numbers = [*(n for n in lengths if not lengths[n]), *assigned]
        self._numbers = dict.fromkeys(n for n in numbers if n not in self._vectors)

    def source(self) -> str:
        body = self._tree.body
        if ast.get_docstring(self._tree) is not None:
            body = body[1:]
        returns = [node for node in ast.walk(self._tree) if isinstance(node, ast.Return)]
        if not body or returns != body[-1:] or returns[0].value is None:
            raise LanguageError("its last line, and no other, must be a return with a value")
        inner = [*self._block(body[:-1], "    ")]
        inner += [f"    return ti.cast({self._number(returns[0].value)}, ti.f64)", ""]
        lines = [f"def rule({', '.join(f'a_{name}' for name in self._arguments)}):"]
        lines += [f"    u_{name} = ti.cast(a_{name}, ti.f64)" for name in self._arguments]
        for name in dict.fromkeys([*self._numbers, *self._lengths]):
            if name not in self._arguments and name not in self._loop_variables:
                n = self._lengths.get(name)
                zero = f"ti.Vector([ti.f64(0.0)] * {n})" if n else "ti.f64(0.0)"
                lines.append(f"    u_{name} = {zero}")
        return "\n".join([*lines, *inner])

    def _refuse(self, node: ast.AST, why: str = "is not allowed") -> NoReturn:
        line = getattr(node, "lineno", 1) - self._first_line + 1
        text = " ".join(ast.unparse(node).split())
        text = text if len(text) <= 60 else text[:57] + "..."
        raise LanguageError(f"line {line} of it, `{text}`, {why}")

    def _block(self, statements: Iterable[ast.stmt], indent: str) -> Iterator[str]:
        for statement in statements:
            yield from self._statement(statement, indent)

    def _statement(self, node: ast.stmt, indent: str) -> Iterator[str]:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            yield f"{indent}{self._target(node.targets[0])} = {self._assigned(node)}"
        elif isinstance(node, ast.AugAssign):
            read = ast.copy_location(ast.Name(getattr(node.target, "id", ""), ast.Load()), node)
            whole = ast.copy_location(ast.BinOp(read, node.op, node.value), node)
            yield f"{indent}{self._target(node.target)} = {self._cast(whole)}"
        elif isinstance(node, ast.If):
            yield f"{indent}if {self._truth(node.test)}:"
            yield from self._block(node.body, indent + "    ")
            if node.orelse:
                yield f"{indent}else:"
                yield from self._block(node.orelse, indent + "    ")
        elif isinstance(node, ast.For) and not node.orelse:
            yield f"{indent}{self._enter(node.iter, node.target)}:"
            yield from self._block(node.body, indent + "    ")
            self._loops.pop()
        elif isinstance(node, ast.Pass):
            yield f"{indent}pass"
        else:
            self._refuse(node)

    def _target(self, node: ast.expr) -> str:
        if not isinstance(node, ast.Name):
            self._refuse(node, "is not allowed; assign to one name at a time")
        is_input = self._arguments.get(node.id) or {node.id} & self._vectors & {*self._arguments}
        if node.id in self._loop_variables or is_input:
            self._refuse(node, "cannot be assigned; choose another name")
        return f"u_{node.id}"

    def _assigned(self, node: ast.Assign) -> str:
        name = getattr(node.targets[0], "id", "")
        if name not in self._vectors:
            return self._cast(node.value)
        vector, length = self._vector(node.value)
        if self._lengths.setdefault(name, length) != length:
            self._refuse(node, f"must have {self._lengths[name]} entries, as before")
        return vector

    def _enter(self, over: ast.expr, variable: ast.expr) -> str:
        """Return the head of a loop, which is then the innermost one of the present loops."""
        is_range = isinstance(over, ast.Call) and ast.unparse(over.func) == "range"
        if not is_range or not isinstance(variable, ast.Name) or variable.id in self._lengths:
            self._refuse(over, "is not allowed; a loop must be over a range of literal numbers")
        try:
            repeats = range(*(ast.literal_eval(bound) for bound in over.args))  # type: ignore[attr-defined]
        except (TypeError, ValueError):
            self._refuse(over, "must have literal whole numbers")
        self._loops.append((variable.id, len(repeats)))
        self._check_repeats(over)
        return f"for u_{variable.id} in ti.static({ast.unparse(over)})"

    def _check_repeats(self, node: ast.expr, n: int = 1) -> None:
        total = math.prod((max(1, repeats) for _, repeats in self._loops), start=n)
        if total > _MOST_REPEATS:
            self._refuse(node, f"repeats {total} times; at most {_MOST_REPEATS} are allowed")

    def _vector(self, node: ast.expr) -> tuple[str, int]:
        """Return an expression of a vector, f64, and its length."""
        source, length = "", 0
        if isinstance(node, ast.Name):
            source, length = f"u_{node.id}", self._lengths.get(node.id, 0)
        elif isinstance(node, ast.List):
            length = len(node.elts)
            source = f"ti.Vector([{', '.join(map(self._cast, node.elts))}])"
        elif isinstance(node, ast.ListComp) and len(node.generators) == 1:
            (generator,) = node.generators
            if not generator.ifs and not generator.is_async:
                head = self._enter(generator.iter, generator.target)
                source, length = f"ti.Vector([{self._cast(node.elt)} {head}])", self._loops.pop()[1]
        if not length:
            self._refuse(node, "is not a vector, for example `[0.2 * k for k in range(3)]`")
        self._check_repeats(node, length)
        return source, length

    def _cast(self, node: ast.expr) -> str:
        return f"ti.cast({self._number(node)}, ti.f64)"

    def _number(self, node: ast.expr) -> str:
        """Return an expression of a number, f64."""
        if isinstance(node, ast.Constant):
            return self._literal(node, node.value)
        if isinstance(node, ast.Name):
            return self._name(node)
        if isinstance(node, ast.Attribute):
            name, *attributes = ast.unparse(node).split(".")
            outside = self._outside.get(name)
            value = reduce(lambda of, attribute: getattr(of, attribute, None), attributes, outside)
            return self._literal(node, value)
        if isinstance(node, ast.Subscript):
            return self._entry(node)
        operator = type(getattr(node, "op", None))
        form = _OPERATORS.get(operator, "")
        if isinstance(node, ast.BinOp) and form:
            return f"({form.format(self._number(node.left), self._number(node.right))})"
        if isinstance(node, ast.UnaryOp) and form:
            return f"({form.format(self._number(node.operand))})"
        if isinstance(node, ast.Compare):
            return f"ti.cast({self._truth(node)}, ti.f64)"
        if isinstance(node, ast.IfExp):
            branches = f"{self._number(node.body)}, {self._number(node.orelse)}"
            return f"ti.select({self._truth(node.test)}, {branches})"
        if isinstance(node, ast.Call):
            return self._call(node)
        self._refuse(node, _INSTEAD.get(operator, "is not allowed"))

    def _literal(self, node: ast.expr, value: Any) -> str:
        if not isinstance(value, (bool, int, float)):
            self._refuse(node, "is not a number")
        return f"ti.f64({float(value)!r})"

    def _name(self, node: ast.Name) -> str:
        if any(node.id == variable for variable, _ in self._loops):
            return f"ti.cast(u_{node.id}, ti.f64)"
        if node.id in self._numbers and node.id not in self._loop_variables:
            return f"u_{node.id}"
        if node.id in self._lengths:
            self._refuse(node, "is a vector; use its entries, for example with [0]")
        if node.id in self._loop_variables:
            self._refuse(node, "is used outside its loop")
        if node.id not in self._outside:
            self._refuse(node, "is not defined")
        return self._literal(node, self._outside[node.id])

    def _entry(self, node: ast.Subscript) -> str:
        name = node.value.id if isinstance(node.value, ast.Name) else ""
        length, index = self._lengths.get(name, 0), node.slice
        if not length:
            self._refuse(node, "is not an entry of a vector")
        if isinstance(index, ast.Constant):
            if type(index.value) is not int or not 0 <= index.value < length:
                self._refuse(node, f"must have an index from 0 to {length - 1}")
            return f"u_{name}[{index.value}]"
        if isinstance(index, ast.Name) and any(index.id == variable for variable, _ in self._loops):
            return f"u_{name}[u_{index.id}]"
        if name in self._vectors:
            self._refuse(node, "must have a literal number or the name of a loop as index")
        number = f"ti.cast({self._number(index)}, ti.i32)"
        return f"u_{name}[ti.max(ti.min({number}, {length - 1}), 0)]"

    def _call(self, node: ast.Call) -> str:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in FUNCTIONS or name in self._numbers:
            self._refuse(node, f"calls another function than {', '.join(FUNCTIONS)}")
        wanted, of_vector = FUNCTIONS[name], name == "pick"
        arguments = [self._vector(argument)[0] for argument in node.args[:of_vector]]
        arguments += [self._number(argument) for argument in node.args[of_vector:]]
        is_folded = name in ("min", "max") and len(arguments) >= wanted
        if node.keywords or not (len(arguments) == wanted or is_folded):
            self._refuse(node, f"must have {wanted} arguments")
        if is_folded:
            return reduce(lambda result, argument: f"{name}_({result}, {argument})", arguments)
        return f"{name}_({', '.join(arguments)})"

    def _truth(self, node: ast.expr) -> str:
        """Return an expression of a truth value."""
        if isinstance(node, ast.BoolOp):
            sign = " & " if isinstance(node.op, ast.And) else " | "
            return f"({sign.join(self._truth(operand) for operand in node.values)})"
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return f"(not {self._truth(node.operand)})"
        if not isinstance(node, ast.Compare):
            return f"({self._number(node)} != ti.f64(0.0))"
        parts, left = [], self._number(node.left)
        for operator, right in zip(node.ops, node.comparators, strict=True):
            if type(operator) not in _COMPARISONS:
                self._refuse(node)
            following = self._number(right)
            parts.append(f"({left} {_COMPARISONS[type(operator)]} {following})")
            left = following
        return f"({' & '.join(parts)})"
