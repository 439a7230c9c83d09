#!/usr/bin/python3
"""Derives the modes of the transfers, and prints the lists of sections 1 and 2 of the PolyPIC supplement with its errata put right:
basis functions s_r, norms <s_r, s_r> and the coefficients c_r from node velocities, for the linear and the quadratic kernel in two
and three dimensions. Then proves, symbolically in the offsets, that the coefficients are those of the modes (L Q = 1) and that the
modes are orthogonal under the weights (Q^T M Q diagonal). Exits 1 when a proof fails.

Needs sympy (Debian: apt install python3-sympy); the program does not.
"""
import itertools
import sys

from sympy import Matrix, Rational, cancel, diag, factor, simplify, symbols
from sympy.polys.domains import QQ
from sympy.polys.rings import ring

x, h = symbols("x h")

# Nodes [h] and weights by the particle's offset x [h] from node 0: the left node (linear) or the middle one (quadratic).
KERNELS = {
    "linear": ([0, 1], [1 - x, x]),
    "quadratic": ([-1, 0, 1], [(Rational(1, 2) - x) ** 2 / 2, Rational(3, 4) - x**2, (Rational(1, 2) + x) ** 2 / 2]),
}
# The axes' polynomials in a mode, 0: 1, 1: w, 2: g. The supplement's order; 6, 7 and 13, 14 of three dimensions as their formulas say.
ORDER = {
    2: "00 10 01 11 20 02 21 12 22".split(),
    3: "000 100 010 001 110 101 011 111 200 020 002 220 202 022 222 210 201 211 120 021 121 102 012 112 221 212 122".split(),
}


def one_axis(kernel):
    """Gram-Schmidt of 1, w, w^2 under the weights, the dual rows and the norms, lengths in cells."""
    nodes, weights = KERNELS[kernel]
    w = [node - x for node in nodes]
    inner = lambda a, b: sum(n * p * q for n, p, q in zip(weights, a, b))
    columns = []
    for degree in range(len(nodes)):
        column = [wi**degree for wi in w]
        power = list(column)
        for earlier in columns:
            share = factor(cancel(inner(power, earlier) / inner(earlier, earlier)))
            column = [simplify(c - share * e) for c, e in zip(column, earlier)]
            if degree == 2 and share != 0:
                print(f"  share of {'1 w'.split()[columns.index(earlier)]} taken from w^2: {share}")
        columns.append([factor(c) for c in column])
    Q = Matrix(columns).T
    L = Q.inv().applyfunc(lambda e: factor(cancel(e)))
    M = diag(*weights)
    norms = [factor(d) for d in (Q.T * M * Q).diagonal()]
    print(f"  det Q = {simplify(Q.det())}: invertible at every x")
    for name, row, norm in zip("1 w g".split(), L.tolist(), norms):
        print(f"  {name}: dual row {row}, norm {norm}")
    return Q, L, weights, norms


def base_text(axis, degree):
    offset = f"(x_i{axis} - x_p{axis})"
    return {"0": "", "1": offset, "2": f"g{axis}"}[degree]


def norm_text(axis, degree, kernel):
    if degree == "0":
        return ""
    if kernel == "linear":
        return f"x{axis} (h - x{axis})"
    return {"1": "h^2/4", "2": f"(h^2 - 4 x{axis}^2)^2 (3 h^2 - 4 x{axis}^2) / (16 h^2)"}[degree]


def row_text(axis, degree, kernel):
    """The dual row in metres: constant (numerator, denominator, power of h below) and what is summed."""
    if degree == "0":
        return 1, 1, 0, f"N{axis}"
    if kernel == "linear":
        return 1, 1, 1, f"d{axis}"
    return (4, 1, 2, f"N{axis} (x_i{axis} - x_p{axis})") if degree == "1" else (1, 2, 2, f"e{axis}")


def check_row_text(kernel, axis):
    """The closed forms that row_text() and norm_text() print are those that were derived."""
    Q, L, weights, norms = axis
    nodes = KERNELS[kernel][0]
    rows = [weights, [-1, 1] if kernel == "linear" else [4 * n * (node - x) for n, node in zip(weights, nodes)]]
    closed = [1, x * (1 - x)] if kernel == "linear" else [1, Rational(1, 4), (1 - 4 * x**2) ** 2 * (3 - 4 * x**2) / 16]
    if kernel == "quadratic":
        rows.append([Rational(1, 2), -1, Rational(1, 2)])
    return (Matrix(rows) - L).applyfunc(simplify).is_zero_matrix and all(simplify(a - b) == 0 for a, b in zip(closed, norms))


def print_list(kernel, dimension):
    modes = [m for m in ORDER[dimension] if kernel == "quadratic" or "2" not in m]
    print(f"\n{dimension}-D, {kernel} kernel: {len(modes)} modes")
    if kernel == "quadratic":
        print("  g_a = w_a^2 - x_a (h^2 - 4 x_a^2) / h^2 w_a - h^2/4,  w_a = x_ia - x_pa,  x_a = x_pa less the nearest node;  e_a = 1, -2, 1 at the axis' three nodes")
    else:
        print("  x_a = x_pa less the left node;  d_a = -1, 1 at the axis' two nodes")
    print("  sums run over the nodes i of the stencil; v_i is one component of the velocity; N_a are the weights of axis a")
    for number, mode in enumerate(modes, 1):
        parts = [row_text(a, d, kernel) for a, d in enumerate(mode, 1)]
        over = under = 1
        power = 0
        for part in parts:
            over, under, power = over * part[0], under * part[1], power + part[2]
        constant = Rational(over, under)
        below = (f"{constant.q} " if constant.q > 1 and power else "") + (f"h^{power}" if power > 1 else "h" if power else "")
        front = (f"{constant.p} / ({below}) " if " " in below else f"{constant.p} / {below} ") if power else ""
        join = lambda texts, empty: " ".join(t for t in texts if t) or empty
        print(f"  s{number} = {join((base_text(a, d) for a, d in enumerate(mode, 1)), '1')}")
        print(f"      <s{number}, s{number}> = m_p {join((norm_text(a, d, kernel) for a, d in enumerate(mode, 1)), '')}".rstrip())
        print(f"      c{number} = {front}sum_i {join((p[3] for p in parts), '')} v_i")


def prove(kernel, dimension, axis):
    """L Q = 1 and Q^T M Q diagonal with the product of norms, entry by entry, as polynomials in the offsets of all axes."""
    Q, L, weights, norms = axis
    R, *offsets = ring([f"x{a}" for a in range(1, dimension + 1)], QQ)
    lift = lambda expression, a: sum((QQ(int(c.p), int(c.q)) * offsets[a] ** k[0] for k, c in expression.as_poly(x).terms()), R(0))
    n = len(weights)
    table = lambda entries: [[[lift(entries[i][j], a) for j in range(n)] for i in range(n)] for a in range(dimension)]
    q, l = table(Q.tolist()), table(L.tolist())
    weight = [[lift(e + 0 * x, a) for e in weights] for a in range(dimension)]
    norm = [[lift(e + 0 * x, a) for e in norms] for a in range(dimension)]
    modes = [tuple(int(d) for d in m) for m in ORDER[dimension] if all(int(d) < n for d in m)]
    nodes = list(itertools.product(range(n), repeat=dimension))

    def product(factors):
        result = R(1)
        for f in factors:
            result *= f
        return result

    value = {(i, m): product(q[a][i[a]][m[a]] for a in range(dimension)) for i in nodes for m in modes}
    row = {(m, i): product(l[a][m[a]][i[a]] for a in range(dimension)) for i in nodes for m in modes}
    mass = {i: product(weight[a][i[a]] for a in range(dimension)) for i in nodes}
    heavy = {(i, m): mass[i] * value[i, m] for i in nodes for m in modes}
    for r in modes:
        for s in modes:
            dual = sum((row[r, i] * value[i, s] for i in nodes), R(0))
            gram = sum((heavy[i, r] * value[i, s] for i in nodes), R(0)) if r <= s else None
            if dual != (1 if r == s else 0):
                return False
            if gram is not None and gram != (product(norm[a][r[a]] for a in range(dimension)) if r == s else 0):
                return False
    return True


def main():
    sound = True
    axes = {}
    for kernel in KERNELS:
        print(f"\none axis, {kernel} kernel, lengths in cells")
        axes[kernel] = one_axis(kernel)
        sound &= check_row_text(kernel, axes[kernel])
    for kernel, dimension in itertools.product(KERNELS, (2, 3)):
        print_list(kernel, dimension)
    print()
    for kernel, dimension in itertools.product(KERNELS, (2, 3)):
        good = prove(kernel, dimension, axes[kernel])
        sound &= good
        print(f"{dimension}-D, {kernel}: L Q = 1 and Q^T M Q diagonal: {'proved' if good else 'WRONG'}", flush=True)
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
