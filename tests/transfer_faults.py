#!/usr/bin/python3 -B
"""Plants faults in a copy of the transfers, one at a time, and shows which tests notice.

    tests/transfer_faults.py [BUILD_DIR [NUMBER...]]        default: build/faults, all of them
    tests/transfer_faults.py --fits                         builds nothing: whether the sources still hold every line that a fault changes

The copy is built once with all faults in it, each behind a number that the environment chooses, so a fault costs a run of the tests
and no build. Prints a line a fault: its number, what it is, the tests that fail. Exits 1 when a fault goes unnoticed, or when a test fails
for none of them: such a test proves nothing that these lines could break.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parent.parent
SUITES = [f"transfer_{name}" for name in "identities supplement brute_force conservation carry symmetry".split()]
BASIS, CARRY, MODES, BODIES, MAC, ORDER, PARTICLES, TENSOR, LATTICE = (
    f"sim/transfer/{name}" for name in "basis.h carry.h modes.cpp grid_transfer_bodies.h mac_transfer.h order.cpp particles.h tensor.h lattice.h".split())

# What is wrong, where, the text as it is and with the fault in it; @ is true where the fault is planted.
FAULTS = [
    ("dual row of w off by 0.1 %", BASIS, "{4 * weight[0] * phi[1][0]", "{(@ ? Real(4004) / Real(1000) : Real(4)) * weight[0] * phi[1][0]"),
    ("dual row of g off by 0.1 %", BASIS, "Row<Real, 3>{half, -1, half}}", "Row<Real, 3>{half, @ ? Real(-999) / Real(1000) : Real(-1), half}}"),
    ("dual row of w off by 0.1 %, linear kernel", BASIS, "dual = {weight, Row<Real, 2>{-1, 1}}",
     "dual = {weight, Row<Real, 2>{-1, @ ? Real(1001) / Real(1000) : Real(1)}}"),
    ("sign of w at the middle node", BASIS, "Row<Real, 3>{-1 - x, -x, 1 - x}", "Row<Real, 3>{-1 - x, @ ? Real(x) : Real(-x), 1 - x}"),
    ("g expanded, not factorised", BASIS, "Row<Real, 3>{upper * upper * bend, -product * product * quarter, lower * lower * bend}}",
     "@ ? planted_g(x, x) : Row<Real, 3>{upper * upper * bend, -product * product * quarter, lower * lower * bend}}"),
    ("g of the particle's absolute position, as printed", BASIS, "@5 ? planted_g(x, x) :", "@5 ? planted_g(x, x) : @ ? planted_g(x, Real(x + cell)) :"),
    ("weight of the middle node too large by 0.001", BASIS, "3 * half * half - x * x,", "3 * half * half - x * x + (@ ? Real(1) / Real(1000) : Real(0)),"),
    ("at half a cell the lower base node", BASIS, "!centred && t >= half;", "!centred && (@ ? t > half : t >= half);"),
    ("base node one too low", BASIS, "base = cell - int(!upper);", "base = cell - int(!upper) - (@ ? 1 : 0);"),
    ("norm of g with the power 1 of 1 - 4x^2", BASIS, "return product * product * (3", "return product * (@ ? Real(1) : product) * (3"),
    ("norm of w off by 0.1 %, linear kernel", BASIS, ": x * (1 - x); }", ": x * (1 - x) * (@ ? Real(1001) / Real(1000) : Real(1)); }"),
    ("modes 7 and 8 of two dimensions swapped", MODES, "modes.assign(std::begin(kSupplementOrder2), std::end(kSupplementOrder2));",
     "{ modes.assign(std::begin(kSupplementOrder2), std::end(kSupplementOrder2)); if (@) std::swap(modes[6], modes[7]); }"),
    ("modes 6 and 7 of three dimensions swapped", MODES, "else modes.assign(std::begin(kSupplementOrder3), std::end(kSupplementOrder3));",
     "else modes.assign(std::begin(kSupplementOrder3), std::end(kSupplementOrder3));\n  if (D == 3 && @) std::swap(modes[5], modes[6]);"),
    ("modes 13 and 14 of three dimensions swapped", MODES, "if (D == 3 && @13)", "if (D == 3 && @) std::swap(modes[12], modes[13]);\n  if (D == 3 && @13)"),
    ("the set \"quadratic\" of degree up to 3", MODES, "total_degree<D>(m) <= 2", "total_degree<D>(m) <= (@ ? 3 : 2)"),
    ("APIC without the gradient along the last axis", MODES, "return total_degree<D>(m) <= 1;", "return total_degree<D>(m) <= 1 && !(@ && m[D - 1] == 1);"),
    ("axes of a tensor in the other order", TENSOR, "place = place * n + index[axis];", "place = place * n + index[std::size_t(@ ? D - 1 - axis : axis)];"),
    ("weight of the first axis left out", TENSOR, "for (int axis = D - 2; axis >= 0; --axis) {", "for (int axis = D - 2; axis >= (@ ? 1 : 0); --axis) {"),
    ("coefficient of k off by one mode", BODIES, "c[r] = value[place_[r]];", "c[r] = value[place_[@ ? (r + 1) % place_.size() : r]];"),
    ("all faces on the lattice of the first component", MAC, "return axis != lattice;", "return axis != (@ ? 0 : lattice);"),
    ("FLIP keeps all, whatever its rule", BODIES, "Real(rule.keep) * (c[0] - then)", "Real(@ ? 1.0 : rule.keep) * (c[0] - then)"),
    ("spin with the norm of the quadratic kernel", BODIES, "double(c[r]) * norm);", "double(c[r]) * (@ ? 0.25 : norm));"),
    ("light places keep their momentum", BODIES, "v = valid ? v / mass[i] : Real(0);", "v = valid ? v / mass[i] : @ ? v : Real(0);"),
    ("no place is too light", BODIES, "double(mass[i]) > kLightestNode;", "double(mass[i]) > (@ ? 0.0 : kLightestNode);"),
    ("limiter with the norm's fourth root", CARRY, "return std::max(Real(0), (1 - 2 * x) * (1 + 2 * x)) * std::sqrt(3 - 4 * x * x) / 4;",
     "const Real d = std::max(Real(0), (1 - 2 * x) * (1 + 2 * x)) * std::sqrt(3 - 4 * x * x) / 4;\n  return @ ? std::sqrt(d) : d;"),
    ("limiter with the norm, not its root", CARRY, "return @25 ? std::sqrt(d)", "return @ ? d * d : @25 ? std::sqrt(d)"),
    ("limiter upside down", CARRY, "std::min(Real(1), before / now)", "std::min(Real(1), @ ? now / before : before / now)"),
    ("limiter drops what has no energy now", CARRY, "now <= 0 ? Real(1)", "now <= 0 ? Real(@ ? 0 : 1)"),
    ("limiter scales modes with w too", CARRY, "unsigned(mode[a] == 2) << a", "unsigned(mode[a] >= (@ ? 1 : 2)) << a"),
    ("fixed carry limits", BODIES, "if (carry == Carry::fixed) return 0;", "if (carry == Carry::fixed && !@) return 0;"),
    ("hybrid limits beside ten times heavier nodes", BODIES, "Real(kLightNode)", "Real(@ ? 10 * kLightNode : kLightNode)"),
    ("hybrid looks at the masses of the first component", BODIES, "!beside_light(l, before)", "!beside_light(@ ? 0 : l, before)"),
    ("particles of a cell in the order they are stored", ORDER, "sorted[i < count ? below : count] = from[i < count ? i : 0];", "sorted[i < count ? (@ ? i : below) : count] = from[i < count ? i : 0];"),
    ("an offset may round to 1", PARTICLES, "const bool next = rest >= 1;", "const bool next = !@ && rest >= 1;"),
    ("norm of g zero at a quarter of a cell", BASIS, "const Real product = (1 - 2 * x) * (1 + 2 * x);\n    return",
     "const Real product = @ ? Real((1 - 4 * x) * (1 + 4 * x)) : Real((1 - 2 * x) * (1 + 2 * x));\n    return"),
    ("neighbouring blocks of one colour", LATTICE, "? block[a] % 2 :", "? (@ ? 0 : block[a] % 2) :"),
]
# What no fault here can break: it is about the supplement's text alone.
ABOUT_THE_TEXT = {"Supplement.PrintsCoefficientsSevenAndEightOfTwoDimensionsWrong"}

HEADER = """#pragma once
// Written by tests/transfer_faults.py.
#include <array>
#include <cstdlib>
namespace sim {
inline bool planted(int number) {
  static const int chosen = [] { const char* text = std::getenv("POLYPIC_FAULT"); return text ? std::atoi(text) : 0; }();
  return chosen == number;
}
template <class Real>
std::array<Real, 3> planted_g(const Real& x, const Real& printed) {
  std::array<Real, 3> g;
  for (int i = 0; i < 3; ++i) {
    const Real w = i - 1 - x;
    g[std::size_t(i)] = w * w - printed * (1 - 4 * printed * printed) * w - Real(1) / Real(4);
  }
  return g;
}
}  // namespace sim
"""


def give_up(message):
    sys.exit(f"{pathlib.Path(sys.argv[0]).stem}: {message}")


def numbered(text, own):
    return re.sub(r"@(\d*)", lambda m: f"planted({m[1] or own})", text)


def planted_texts():
    """The sources that faults change, by file, with every fault in its place."""
    texts = {}
    for number, (name, file, good, bad) in enumerate(FAULTS, 1):
        text = texts.setdefault(file, (ROOT / file).read_text())
        good = numbered(good, number)
        if text.count(good) != 1:
            give_up(f"fault {number}, {name}: {file} holds its line {text.count(good)} times, not once: {good}")
        texts[file] = text.replace(good, numbered(bad, number))
    return texts


def fits():
    """Whether that is all that was asked; ends the program where a fault has no place."""
    if sys.argv[1:] != ["--fits"]:
        return False
    planted_texts()
    print(f"{len(FAULTS)} faults have their place")
    return True


def plant(copy):
    """The tree without what is built, with every fault in its place."""
    texts = planted_texts()
    for folder in "base sim tests cmake docs surface render app bench".split():
        target = copy / folder
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(ROOT / folder, target)   # keeps times: what did not change is not built again
    shutil.copy2(ROOT / "CMakeLists.txt", copy)
    of_table = max(pathlib.Path(f).stat().st_mtime for f in (__file__, sys.argv[0]))

    def write(file, text):   # as old as what it is made of, so that a second run builds nothing
        (copy / file).write_text(text)
        of_source = (ROOT / file).stat().st_mtime if (ROOT / file).exists() else 0
        os.utime(copy / file, (max(of_table, of_source),) * 2)

    for file, text in texts.items():
        include = '#include "sim/transfer/planted.h"\n'
        write(file, include + text if file.endswith(".cpp") else text.replace("#pragma once\n", "#pragma once\n" + include, 1))
    write("sim/transfer/planted.h", HEADER)


def build(copy, folder):
    run = lambda *words: subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    run("cmake", "-S", str(copy), "-B", str(folder), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release")
    run("cmake", "--build", str(folder), "--parallel", str(min(2, os.cpu_count() or 1)), "--target", *(f"test_{s}" for s in SUITES))


def tests_of(folder, suite):
    """Names of the tests of a suite."""
    names, group = [], ""
    for line in subprocess.run([folder / f"tests/test_{suite}", "--gtest_list_tests"], capture_output=True, text=True, check=True).stdout.splitlines():
        if line.startswith("  "):
            names.append(group + line.split()[0])
        elif line.endswith("."):
            group = line
    return names


def failing(folder, suite, fault, without=()):
    """The tests of a suite that fail with a fault, of all but some; one that ends the program has failed, and those behind it are run without it."""
    environment = dict(os.environ, POLYPIC_FAULT=str(fault))
    failed, ended = set(), list(without)
    while True:
        words = [folder / f"tests/test_{suite}", "--gtest_filter=*" + ("-" + ":".join(ended) if ended else "")]
        result = subprocess.run(words, capture_output=True, text=True, env=environment, errors="replace")
        started = re.findall(r"^\[ RUN      \] (\S+)", result.stdout, re.M)
        failed |= set(re.findall(r"^\[  FAILED  \] (\S+) \(\d+ ms\)", result.stdout, re.M))
        if result.returncode in (0, 1) or not started:
            return failed
        ended.append(started[-1])
        failed.add(started[-1])


def main():
    if fits():
        return 0
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/faults").resolve()
    copy = folder / "source"
    copy.mkdir(parents=True, exist_ok=True)
    plant(copy)
    build(copy, folder / "build")
    built = folder / "build"
    everything = {name for suite in SUITES for name in tests_of(built, suite)}
    chosen = [int(n) for n in sys.argv[2:]] or list(range(1, len(FAULTS) + 1))
    def run(number):
        found = sorted(set().union(*(failing(built, suite, number) for suite in SUITES)))
        if number > 0:
            name, file, _, _ = FAULTS[number - 1]
            print(f"{number:2} {name} ({pathlib.Path(file).name}): {', '.join(found) or 'NOTHING FAILS'}", flush=True)
        return found
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip([0] + chosen, pool.map(run, [0] + chosen)))
    if found[0]:
        give_up(f"without a fault these fail: {' '.join(found[0])}")
    unnoticed = sum(not found[number] for number in chosen)
    print(f"\n{len(chosen)} faults, {unnoticed} unnoticed")
    if len(chosen) < len(FAULTS):
        return 1 if unnoticed else 0
    unbroken = sorted(everything - set().union(*found.values()) - ABOUT_THE_TEXT)
    print(f"{len(everything)} tests, {len(unbroken)} that no fault fails")
    for name in unbroken:
        print(f"   {name}")
    return 1 if unbroken or unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
