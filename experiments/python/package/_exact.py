"""Steps that are exact where the rates are linear in the states.

With x' = A x + b:

    constant   A of parameters alone, b of inputs and parameters: x+ = exp(A dt) x + dt phi_1(A dt) b
    series     A of inputs too, in each of them affine: x+ = x + dt phi_1(A dt) (A x + b), by the series of phi_1
    partly     the terms of the rates that are a number times a state are A x, what is left is b(x): the fourth-order
               exponential Runge-Kutta method of Cox and Matthews (Journal of Computational Physics 176, 2002), whose
               steps are exact where b does not change
"""

from __future__ import annotations

import sympy as sp

from . import _expressions as ex
from ._header import Scheme, wrapped


def scheme(header):
    x, inputs = header.states, set(header.switched + header.inputs)
    a = sp.Matrix([[sp.diff(r, s) for s in x] for r in header.rates]).applyfunc(ex.tidy)
    b = [ex.tidy(r - sum(a[i, j] * x[j] for j in range(len(x)))) for i, r in enumerate(header.rates)]
    if not set().union(a.free_symbols, *(e.free_symbols for e in b)) & set(x):
        if not a.free_symbols & inputs:
            return Constant(header, a, b)
        bent = a.has(sp.Abs, sp.sign, sp.Min, sp.Max, sp.Heaviside, sp.Piecewise)
        if not bent and all(ex.tidy(sp.diff(entry, v, 2)) == 0 for entry in a for v in inputs):
            return Series(header, a, b)
    a = sp.zeros(len(x), len(x))
    for i, rate in enumerate(header.rates):
        for term in sp.Add.make_args(sp.expand(rate)):
            for j, state in enumerate(x):
                coefficient = term / state
                if not coefficient.free_symbols & set(x + header.switched + header.inputs):
                    a[i, j] += coefficient
    if a.is_zero_matrix:
        raise ex.Refused("integrator 'exact': no rate has a part that is a number times a state (allowed: rk4, euler)")
    b = [sp.expand(r) - sum(a[i, j] * x[j] for j in range(len(x))) for i, r in enumerate(header.rates)]
    return Partly(header, a, [sp.expand(e) for e in b])


def reach(a):
    """Which entries of functions of A are not zero whatever its numbers: a set of index pairs, the diagonal in it."""
    n = a.rows
    pairs = {(i, j) for i in range(n) for j in range(n) if i == j or a[i, j] != 0}
    while True:
        more = {(i, k) for i, j in pairs for jj, k in pairs if j == jj} - pairs
        if not more:
            return pairs
        pairs |= more


class Linear(Scheme):
    """What those with a constant A share: coefficients of one dt, computed for `tick_s` in the constructor."""

    def __init__(self, header, a, b):
        super().__init__(header)
        self.a, self.b, self.pairs = a, b, reach(a)
        header.includes.add("solenoid/core/mpc/matrix_exponential.hpp")
        n = a.rows
        self.entries = [[ex.double_text(a[i, j], {}) if not a[i, j].free_symbols else
                         ("-" if negative(a[i, j]) else "") + header.constants.member(-a[i, j] if negative(a[i, j]) else a[i, j])
                         for j in range(n)] for i in range(n)]

    def sum_of(self, matrix, i, texts):
        """Row i of a product with what `texts` has, those that are None being 0."""
        return [f"S(m.{matrix}[{i}][{j}]) * {t}" for j, t in enumerate(texts) if (i, j) in self.pairs and t is not None]

    def carried(self, matrix, i, vector):
        """The same with a vector of states; where A's row is zero the entry is 1."""
        if all(e == 0 for e in self.a.row(i)):
            return [f"{vector}[{i}]"]
        return self.sum_of(matrix, i, [f"{vector}[{j}]" for j in range(self.a.rows)])

    def computed(self):
        """The function that has the coefficients of any dt."""
        n = self.a.rows
        rows = ", ".join("{" + ", ".join(row) + "}" for row in self.entries)
        return ["  /// Those of a step dt.", "  [[gnu::noinline]] Exact exact(double dt) const {",
                wrapped(f"solenoid::SquareMatrix<{n}> a = {{{{{rows}}}}};", 4)]

    def constructor_body(self):
        return ["    exact_ = exact(tick_s);"]

    def members(self):
        return ["  Exact exact_;"]

    def chosen(self):
        return ["    Exact other;",
                "    const Exact& m = dt == tick_s ? exact_ : (other = exact(dt));"]

    def constant_of_tick(self):
        return ("  /// The time step [s] whose coefficients the constructor has; another's are computed in every step.\n"
                f"  static constexpr double tick_s = {ex.number_text(self.header.model.tick_s)};\n")


def negative(entry):
    return bool(entry.as_coeff_Mul()[0].is_negative) if not entry.is_Add else False


class Constant(Linear):
    about = ["The rates are linear in the states, A x + b. A step is exact for held inputs: exp(A dt) x + dt phi_1(A dt) b."]

    def functions(self):
        h, n = self.header, len(self.header.states)
        drives = [None if e == 0 else f"b[{j}]" for j, e in enumerate(self.b)]
        rows = []
        for i in range(n):
            held = self.sum_of("f", i, drives)
            rows.append(" + ".join(self.carried("e", i, "state") + ([f"({' + '.join(held)})"] if held else [])))
        lines = [self.constant_of_tick()] + h.step_head() + self.chosen()
        if any(drives):
            lines.append("    const auto b = drive<S>(switched, continuous);")
        public = "\n".join(lines + h.returned(rows) + ["  }"])
        public = public if any(drives) else public.replace("& switched", "&").replace("& continuous", "&")
        coefficients = "\n".join(
            ["  struct Exact {", f"    solenoid::SquareMatrix<{n}> e, f;  // exp(A dt) and its integral over dt", "  };",
             *self.computed(), "    for (auto& row : a)", "      for (double& entry : row) entry *= dt;",
             f"    auto [e, f] = solenoid::phi_functions<{n}, 2>(a);", "    for (auto& row : f)",
             "      for (double& entry : row) entry *= dt;", "    return {e, f};", "  }"])
        private = [coefficients]
        if any(drives):
            private.append(self.rates(self.b, "drive", "The rates at states of 0, b.", ("switched", "continuous")))
        return [public], private


class Series(Scheme):
    about = ["The rates are linear in the states, A x + b, with A of the inputs. A step is exact for held inputs up to",
             "rounding: x + dt phi_1(A dt) (A x + b) by the series of phi_1, in pieces in which |A| dt is at most 1/2."]

    def __init__(self, header, a, b):
        super().__init__(header)
        self.a, self.b = a, b
        header.includes.add("algorithm")

    def constructor_body(self):
        """The most that |A| can be: a norm of what is affine in each input is greatest at a corner."""
        h, n = self.header, len(self.header.states)
        lines = []
        if not h.switched and not h.inputs:
            return lines
        count = len(h.switched) + len(h.inputs)
        corner = [f"(corner >> {i} & 1u) != 0 ? 1.0 : 0.0" for i in range(len(h.switched))]
        most = [f"(corner >> {len(h.switched) + i} & 1u) != 0 ? {ex.number_text(u.most)} : -{ex.number_text(u.most)}"
                for i, u in enumerate(h.model.inputs)]
        lines.append(f"    for (unsigned corner = 0; corner < {1 << count}u; ++corner) {{")
        lines.append(wrapped(f"const Vector<double, {len(corner)}> s = {{{', '.join(corner)}}};", 6))
        lines.append(wrapped(f"const Vector<double, {len(most)}> u = {{{', '.join(most)}}};", 6))
        lines += [f"      Vector<double, {n}> sums{{}};", f"      for (std::size_t j = 0; j < {n}; ++j) {{",
                  f"        Vector<double, {n}> unit{{}};", "        unit[j] = 1.0;",
                  "        const auto column = slope<double>(unit, s, u);",
                  f"        for (std::size_t i = 0; i < {n}; ++i) sums[i] += std::abs(column[i]);", "      }",
                  "      steepest_ = std::max(steepest_, *std::max_element(sums.begin(), sums.end()));", "    }",
                  "    series_ = series(tick_s);"]
        return lines

    def members(self):
        return ["  double steepest_ = 0.0;  // |A| at most [1/s]", "  Series series_;"]

    def functions(self):
        h, n = self.header, len(self.header.states)
        slopes = [sum((self.a[i, j] * h.states[j] for j in range(n)), sp.S.Zero) for i in range(n)]
        held = "switched, continuous"
        lines = [Linear.constant_of_tick(self).replace("coefficients", "terms")] + h.step_head() + [
            "    const Series by = dt == tick_s ? series_ : series(dt);",
            "    const double piece = dt / by.pieces;",
            "    auto now = state;",
            "    for (int p = 0; p < by.pieces; ++p) {",
            f"      auto term = rates<S>(now, {held}), sum = term;",
            "      for (int k = 2; k <= by.terms; ++k) {",
            f"        const auto next = slope<S>(term, {held});",
            "        const S per(piece / k);",
            wrapped("term = {" + ", ".join(f"S(per * next[{i}])" for i in range(n)) + "};", 8),
            wrapped("sum = {" + ", ".join(f"S(sum[{i}] + term[{i}])" for i in range(n)) + "};", 8), "      }",
            "      const S whole(piece);",
            wrapped("now = {" + ", ".join(f"S(now[{i}] + whole * sum[{i}])" for i in range(n)) + "};", 6),
            "    }", "    return now;", "  }"]
        series = ["  struct Series {", "    int pieces = 1, terms = 1;", "  };",
                  "  /// Pieces of dt, at most 10^6, and terms of the series in each, after which less than 1e-17 is left.",
                  "  [[gnu::noinline]] Series series(double dt) const {", "    const double size = steepest_ * std::abs(dt);",
                  "    const int pieces = static_cast<int>(std::clamp(std::ceil(2.0 * size), 1.0, 1e6));", "    int terms = 1;",
                  "    const double piece = size / pieces;",
                  "    for (double left = 0.5 * piece; left > 1e-17 && terms < 20; left *= piece / (terms + 1.0)) ++terms;",
                  "    return {pieces, terms};", "  }"]
        private = ["\n".join(series), self.rates(),
                   self.rates(slopes, "slope", "A times a vector in the place of the states.")]
        return ["\n".join(lines)], private


class Partly(Linear):
    about = ["The rates are A x + b(x), A x the terms that are a number times a state. A step is one of the fourth-order",
             "exponential Runge-Kutta method of Cox and Matthews (2002): exact where b does not change."]

    def functions(self):
        h, n = self.header, len(self.header.states)
        live = [e != 0 for e in self.b]

        def stage(matrix, vector, drive, scaled):
            return [" + ".join(self.carried(matrix, i, vector) + self.sum_of(
                drive, i, [scaled.format(j=j) if live[j] else None for j in range(n)])) for i in range(n)]

        def vector(name, rows):
            return "\n".join(h.returned([f"S({r})" for r in rows], 4, f"const Vector<S, {n}> {name} = {{"))

        held = "switched, continuous"
        last = []
        for i in range(n):
            terms = self.carried("e", i, "state")
            for j in range(n):
                if live[j] and (i, j) in self.pairs:
                    terms += [f"S(m.first[{i}][{j}]) * b1[{j}]", f"S(m.middle[{i}][{j}]) * (b2[{j}] + b3[{j}])",
                              f"S(m.last[{i}][{j}]) * b4[{j}]"]
            last.append(" + ".join(terms))
        lines = [self.constant_of_tick()] + h.step_head() + self.chosen() + [
            "    const S two(2.0);",
            f"    const auto b1 = drive<S>(state, {held});", vector("x2", stage("half", "state", "drive", "b1[{j}]")),
            f"    const auto b2 = drive<S>(x2, {held});", vector("x3", stage("half", "state", "drive", "b2[{j}]")),
            f"    const auto b3 = drive<S>(x3, {held});",
            vector("x4", stage("half", "x2", "drive", "(two * b3[{j}] - b1[{j}])")),
            f"    const auto b4 = drive<S>(x4, {held});"]
        coefficients = "\n".join(
            ["  struct Exact {", "    // exp(A dt), exp(A dt/2), dt/2 phi_1(A dt/2), and the weights of the four stages",
             f"    solenoid::SquareMatrix<{n}> e, half, drive, first, middle, last;", "  };", *self.computed(),
             "    for (auto& row : a)", "      for (double& entry : row) entry *= dt / 2;",
             f"    const auto phi_half = solenoid::phi_functions<{n}, 2>(a);", "    for (auto& row : a)",
             "      for (double& entry : row) entry *= 2;", f"    const auto phi = solenoid::phi_functions<{n}, 4>(a);",
             "    Exact m{phi[0], phi_half[0], phi_half[1], {}, {}, {}};",
             f"    for (std::size_t i = 0; i < {n}; ++i)", f"      for (std::size_t j = 0; j < {n}; ++j) {{",
             "        m.drive[i][j] *= dt / 2;",
             "        m.first[i][j] = dt * (phi[1][i][j] - 3 * phi[2][i][j] + 4 * phi[3][i][j]);",
             "        m.middle[i][j] = 2 * dt * (phi[2][i][j] - 2 * phi[3][i][j]);",
             "        m.last[i][j] = dt * (4 * phi[3][i][j] - phi[2][i][j]);", "      }", "    return m;", "  }"])
        private = [coefficients, self.rates(self.b, "drive", "The rates without their linear part, b.")]
        return ["\n".join(lines + h.returned(last) + ["  }"])], private
