"""SymPy expressions as C++ for any scalar S: a double, a SIMD batch, a dual number.

A number that does not change during a prediction (of parameters alone) becomes a member that the constructor computes.
What does not change during a step (of inputs) stands together, so that a loop over time computes it once. Sums and products
are grouped so that the longest way from a state to the result is short: a prediction is one chain of steps.
"""

from __future__ import annotations

import dataclasses
import heapq
import re

import sympy as sp
from sympy.printing.cxx import CXX17CodePrinter

FUNCTIONS = ("sqrt, exp, log, sin, cos, tan, tanh, Abs, Min, Max, sign, Heaviside, Piecewise, powers with an exponent that "
             "is a number or a parameter")

# Latencies, about, in units of an addition.
DIVISION, FUNCTION = 3, 8
_OF_ONE = {sp.exp: "exponential", sp.log: "logarithm", sp.tanh: "hyperbolic_tangent", sp.sin: "sine", sp.cos: "cosine"}
_RELATIONS = {sp.StrictLessThan: "<", sp.StrictGreaterThan: ">", sp.LessThan: "<=", sp.GreaterThan: ">=",
              sp.Equality: "==", sp.Unequality: "!="}
INEXACT = (sp.exp, sp.log, sp.tanh)  # whose batches of AVX-512 round in another way


class Refused(ValueError):
    """What has no C++: one line, with what is allowed."""


@dataclasses.dataclass
class Item:
    """A piece of C++. binding: 3 an atom, 2 a product, 1 a sum. depth: operations since a state was read; of what is held
    during a step 0. level: 0 parameters alone, 1 inputs too, 2 states too."""
    text: str
    binding: int = 3
    depth: float = 0.0
    level: int = 0

    def within(self, binding):
        return self.text if self.binding >= binding else f"({self.text})"


class Constants:
    """The members of a class: its parameters, then what is computed of them."""

    def __init__(self, parameters):
        self.parameters = list(parameters)  # symbols
        # A class has members of its own beside them: _exact.py, member().
        self.names = {p: f"{p.name}_value_" if re.match("(exact|series|steepest)$|of_parameters_", p.name) else f"{p.name}_"
                      for p in self.parameters}
        self.derived = []  # pairs of name and expression

    def member(self, expression):
        """The C++ double for an expression of parameters."""
        if expression in self.names:
            return self.names[expression]
        name = f"of_parameters_{len(self.derived)}_"
        self.names[expression] = name
        self.derived.append((name, expression))
        return name


class _Doubles(CXX17CodePrinter):
    """Expressions of parameters, as doubles."""

    def __init__(self, names):
        super().__init__()
        self.own = names

    def _print_Symbol(self, symbol):
        return self.own[symbol]

    def _print_Float(self, number):
        return number_text(number)

    def _print_Rational(self, number):
        return f"({number.p}.0 / {number.q}.0)" if abs(number.p) < 1e6 and number.q < 1e6 else number_text(number)

    def _print_Integer(self, number):
        return f"{int(number)}.0"

    def _print_Pow(self, power):
        if power.exp in (2, 3) and power.base in self.own:
            return "(" + " * ".join([self.own[power.base]] * int(power.exp)) + ")"
        return super()._print_Pow(power)


def double_text(expression, names):
    """C++ for an expression of parameters; `names` has their members."""
    expression = expression.rewrite(sp.Heaviside, sp.Piecewise)
    text = " ".join(_Doubles(names).doprint(expression).split())
    if "Not supported" in text:
        raise Refused(f"'{expression}' has a function of parameters that C++ lacks (allowed: those of <cmath>)")
    return text


def number_text(number):
    """The double nearest to a number, to the last digit."""
    value = float(number)
    if value != value or value in (float("inf"), float("-inf")):
        raise Refused(f"'{number}' is no finite number (allowed: numbers that a double holds)")
    text = repr(value)
    return text if any(c in text for c in ".e") else text + ".0"


class Block:
    """The statements of one function body and what they compute. `roles` has the level of each symbol, `reads` its C++."""

    def __init__(self, constants, roles, reads):
        self.constants, self.roles, self.reads = constants, dict(roles), reads
        self.lines, self.items, self.used = [], {}, set()
        self.inline = {}  # common parts that need no name: of parameters alone, a symbol's multiple
        self.work = 0.0

    def lower(self, expressions):
        """C++ for each expression, common parts once."""
        used = set().union(*(e.free_symbols for e in expressions)) if expressions else set()
        names = sp.numbered_symbols("common", exclude={s for s in used | set(self.roles)})
        replaced, reduced = sp.cse(list(expressions), symbols=names, order="none")
        for symbol, value in replaced:
            level = self._level(value)
            self.roles[symbol] = level
            if level == 0 or value.as_coeff_Mul()[1].is_Symbol:
                self.inline[symbol] = self._full(value)
            else:
                self.items[symbol] = self._named(self._plain(self._full(value)))
        return [self._plain(self._full(e)) for e in reduced]

    def _full(self, expression):
        return expression.xreplace(self.inline)

    def _level(self, expression):
        return max((self.roles[s] for s in expression.free_symbols), default=0)

    def _named(self, item):
        if re.fullmatch(r"\w+|S\([\w.]+\)", item.text):
            return item
        name = f"t{sum(line.startswith('const S t') for line in self.lines)}"
        self.lines.append(f"const S {name} = {item.text};")
        return Item(name, 3, item.depth, item.level)

    def _count(self, level, work=1.0):
        self.work += work if level == 2 else 0.02 * work

    def _operation(self, text, binding, items, latency=1.0):
        level = max(i.level for i in items)
        self._count(level, latency)
        return Item(text, binding, max(i.depth for i in items) + latency if level == 2 else 0.0, level)

    def _constant(self, expression):
        if expression.is_Number or not expression.free_symbols:
            return Item(f"S({number_text(sp.N(expression, 25))})")
        return Item(f"S({self.constants.member(expression)})")

    def _plain(self, expression):
        """The C++ of an expression, its sign in it."""
        negative, item = self._signed(expression)
        if not negative:
            return item
        if expression.is_Mul:  # -2 (a - b) is 2 (b - a)
            sums = [f for f in expression.args if f.is_Add]
            if sums:
                rest = [f for f in expression.args if f is not sums[0]]
                turned = sp.Add(*[-a for a in sums[0].args])
                flipped = sp.Mul(-sp.Mul(*rest), turned, evaluate=False) if rest != [-1] else turned
                negative_too, other = self._signed(flipped)
                if not negative_too:
                    return other
        return self._operation(f"-{item.within(3)}", 2, [item], 0.5)

    def _signed(self, expression):
        """Whether the C++ is that of the expression's negative, and it."""
        coefficient = expression.as_coeff_Mul()[0] if not expression.is_Add else sp.S.One
        if coefficient.is_negative:
            return True, self._positive(-expression)
        return False, self._positive(expression)

    def _positive(self, e):
        if e in self.items:
            return self.items[e]
        if not self._level(e):
            return self._constant(e)
        if e.is_Symbol:
            self.used.add(e)
            return Item(self.reads[e], 3, 0.0, self.roles[e])
        if e.is_Add:
            return self._sum(e)
        if e.is_Mul or e.is_Pow:
            return self._product(e)
        return self._function(e)

    def _sum(self, e):
        fixed = [a for a in e.args if not self._level(a)]
        terms = [self._signed(a) for a in e.args if self._level(a)]
        if fixed:
            total = sp.Add(*fixed)
            negative = bool(total.as_coeff_Mul()[0].is_negative) if not total.is_Add else False
            terms.append((negative, self._constant(-total if negative else total)))

        def joined(a, b):
            if a[0] and not b[0]:
                a, b = b, a
            sign = "-" if a[0] != b[0] else "+"
            right = b[1].within(2 if sign == "-" else 1)
            return a[0], self._operation(f"{a[1].text} {sign} {right}", 1, [a[1], b[1]])

        negative, item = self._joined(terms, joined)
        return self._operation(f"-{item.within(3)}", 2, [item], 0.5) if negative else item

    def _joined(self, items, join):
        """Joins the two that are ready first, until one is left."""
        heap = [(item[1].level, item[1].depth, k, item) for k, item in enumerate(items)]
        heapq.heapify(heap)
        count = len(heap)
        while len(heap) > 1:
            a, b = heapq.heappop(heap), heapq.heappop(heap)
            result = join(a[3], b[3])
            heapq.heappush(heap, (result[1].level, result[1].depth, count, result))
            count += 1
        return heap[0][3]

    def _product(self, e):
        fixed, above, below = sp.S.One, [], []
        for factor in sp.Mul.make_args(e):
            if not self._level(factor):
                fixed *= factor
                continue
            if isinstance(factor, sp.exp):
                above.append(self._function(factor))
                continue
            base, exponent = factor.as_base_exp()
            under = exponent.is_Number and exponent.is_negative
            (below if under else above).append(self._power(base, -exponent if under else exponent))

        def times(a, b):
            return False, self._operation(f"{a[1].within(2)} * {b[1].within(3)}", 2, [a[1], b[1]])

        numerator = [(False, i) for i in above]
        if fixed != 1:
            numerator.append((False, self._constant(fixed)))
        if not below:
            return self._joined(numerator, times)[1]
        held = [i for i in below if i.level < 2]
        if held and len(held) < len(below):  # the quotient of what is held is held
            below = [i for i in below if i.level == 2]
            under = self._joined([(False, i) for i in held], times)[1]
            numerator.append((False, self._operation(f"S(1.0) / {under.within(3)}", 2, [under], DIVISION)))
        over = self._joined(numerator, times)[1] if numerator else Item("S(1.0)")
        under = self._joined([(False, i) for i in below], times)[1]
        return self._operation(f"{over.within(2)} / {under.within(3)}", 2, [over, under], DIVISION)

    def _atom(self, e):
        """An expression that is used more than once, by its name."""
        if e not in self.items:
            self.items[e] = self._named(self._plain(e))
        return self.items[e]

    def _power(self, base, exponent):
        if exponent == 1:
            return self._plain(base)
        if exponent.is_Integer:
            return self._whole_power(base, int(exponent))
        if exponent.is_Rational and exponent.q == 2:
            root = self._call("square_root", self._plain(base))
            if exponent.p == 1:
                return root
            root = self._named(root)
            whole = self._whole_power(base, exponent.p // 2)
            return self._operation(f"{whole.within(2)} * {root.text}", 2, [whole, root])
        if not self._level(exponent):
            item = self._plain(base)
            of = number_text(sp.N(exponent, 25)) if not exponent.free_symbols else self.constants.member(exponent)
            return self._operation(f"solenoid::power<S>({item.text}, {of})", 3, [item], 2 * FUNCTION)
        raise Refused(f"'{sp.Pow(base, exponent)}' has an exponent that changes (allowed: {FUNCTIONS})")

    def _whole_power(self, base, n):
        key = ("power", base, n)
        if n == 1:
            return self._atom(base)
        if key not in self.items:
            if n % 2:
                a, b = self._whole_power(base, n - 1), self._atom(base)
            else:
                a = b = self._whole_power(base, n // 2)
            self.items[key] = self._named(self._operation(f"{a.within(2)} * {b.within(3)}", 2, [a, b]))
        return self.items[key]

    def _call(self, name, item):
        if name == "square_root":
            return self._operation(f"solenoid::square_root<S>({item.text})", 3, [item], FUNCTION)
        return self._operation(f"solenoid::{name}<S>({item.text})", 3, [item], 2 * FUNCTION)

    def _choice(self, condition, yes, no):
        items = [yes, no, condition]
        return self._operation(f"select({condition.text}, {self._wrapped(yes)}, {self._wrapped(no)})", 3, items)

    @staticmethod
    def _wrapped(item):
        return item.text if item.text.startswith("S(") and item.binding == 3 else f"S({item.text})"

    def _function(self, e):
        if type(e) in _OF_ONE:
            return self._call(_OF_ONE[type(e)], self._plain(e.args[0]))
        if isinstance(e, sp.tan):
            return self._positive(sp.Mul(sp.sin(e.args[0]), sp.Pow(sp.cos(e.args[0]), -1), evaluate=False))
        if isinstance(e, sp.Abs):
            item = self._plain(e.args[0])
            return self._operation(f"abs({self._wrapped(item)})", 3, [item])
        if isinstance(e, (sp.Min, sp.Max)):
            name = "min" if isinstance(e, sp.Min) else "max"

            def extreme(a, b):
                return False, self._operation(f"{name}({self._wrapped(a[1])}, {self._wrapped(b[1])})", 3, [a[1], b[1]])

            item = self._joined([(False, self._plain(a)) for a in e.args], extreme)[1]
            return Item(f"S({item.text})", 3, item.depth, item.level)
        if isinstance(e, (sp.sign, sp.Heaviside)):
            of = self._named(self._plain(e.args[0]))
            low, middle = (-1, 0) if isinstance(e, sp.sign) else (0, e.args[1])
            below = self._choice(Item(f"{of.text} < S(0.0)", 1, of.depth, of.level), self._constant(sp.sympify(low)),
                                 self._constant(sp.sympify(middle)))
            return self._choice(Item(f"{of.text} > S(0.0)", 1, of.depth, of.level), self._constant(sp.S.One), below)
        if isinstance(e, sp.Piecewise):
            return self._piecewise(e)
        raise Refused(f"'{e.func.__name__}' in '{e}' has no C++ for every scalar (allowed: {FUNCTIONS})")

    def _piecewise(self, e):
        if e.args[-1][1] != sp.true:
            raise Refused(f"'{e}' says nothing beyond its conditions (allowed: a last branch with True)")
        item = self._plain(e.args[-1][0])
        for value, condition in reversed(e.args[:-1]):
            item = self._choice(self._condition(sp.to_nnf(condition)), self._plain(value), item)
        return item

    def _condition(self, c):
        if isinstance(c, (sp.And, sp.Or)):
            parts = [self._condition(a) for a in c.args]
            sign = " & " if isinstance(c, sp.And) else " | "
            return self._operation(sign.join(f"({p.text})" for p in parts), 1, parts)
        if type(c) not in _RELATIONS:
            raise Refused(f"'{c}' is no condition that C++ can be written for (allowed: <, <=, >, >=, Eq, Ne, And, Or)")
        left, right = self._plain(c.lhs), self._plain(c.rhs)
        return self._operation(f"{left.text} {_RELATIONS[type(c)]} {right.text}", 1, [left, right])


def tidy(expression):
    """An expression in which what cancels has: of rational functions surely, of others where expanding shows it."""
    symbols = expression.free_symbols
    return sp.cancel(expression) if expression.is_rational_function(*symbols) else sp.expand(expression)


def forms(expression):
    """Ways to write an expression, those that are found at once."""
    yield expression
    if expression.count_ops() > 200:
        return
    yield sp.factor_terms(expression)
    yield expression.expand(deep=False)  # the factors of a sum go to its terms
    symbols = expression.free_symbols
    if symbols and expression.is_polynomial(*symbols):
        yield sp.factor(expression)
        yield sp.expand(expression)


def cheapest(expressions, block):
    """Each expression in one of its forms, together of least work; block() makes an empty Block."""

    def work(candidates):
        trial = block()
        trial.lower(candidates)
        return trial.work

    best = list(expressions)
    least = work(best)
    for k, expression in enumerate(expressions):
        for form in dict.fromkeys(forms(expression)):
            candidates = best[:k] + [form] + best[k + 1:]
            needed = work(candidates)
            if needed < 0.999 * least:
                best, least = candidates, needed
    return best
