#!/usr/bin/env python3
"""Counts the instructions of a small liquid's steps under callgrind, on one thread, inside the step only, and fails where what a scene does not name
costs any:

  1. a shot with and without sections that its simulation does not use: within 0.1 %
  2. with SOURCE_DIR: the library against one built from sources in which the other effects do not exist: within 1 %, to the same bits. That
     builds base and sim once more, in SCRATCH_DIR, and is no part of the suite.

    tests/step_instructions.py SCRATCH_DIR PROGRAM [DRIVER SOURCE_DIR]
"""
import os, re, shutil, subprocess, sys

scratch, program, driver, source = (os.path.abspath(a) for a in (*sys.argv[1:], "", "")[:4])
STEP = "*Liquid*::advance*"

SHOT = """[shot]
frames = 2
[sim]
domain = [[0, 0, 0], [0.8, 0.4, 0.4]]
cell = 0.025
[[body]]
name = "water"
shape = { box = [[0, 0, 0], [0.4, 0.4, 0.2]] }
[[effect]]
kind = "gravity"
"""
UNUSED = """[[effect]]
kind = "gravity"
acceleration = [0, 0, 0]
[surface]
smooth = 3
[render]
width = 320
height = 180
denoise = "picture"
caustics = "path"
noise = 0.05
[camera]
position = [0.5, -1.4, 0.7]
target = [0.5, 0.25, 0.12]
aperture = 2.8
[[light]]
kind = "sphere"
[look.water]
ior = 1.4
[look.gold]
model = "conductor"
[preview]
color = "vorticity"
[quality.extreme.sim]
cell = 0.0125
"""

# What is taken out of the sources: (file, pattern, replacement). Each must be found, or this list is out of date.
FIXED = """
/// The choices of one scene, known to the compiler: what the others need is no code.
struct OneScene : Options {
  OneScene(const Options& o) : Options(o) {}
  static constexpr Transfer transfer = Transfer::polypic;
  static constexpr Kernel kernel = Kernel::linear;
  static constexpr Splitting splitting = Splitting::lie;
  static constexpr Advection advection = Advection::rk2;
  static constexpr Carry carry = Carry::fixed;
};

/// No colliders.
struct NoShapes {
  static constexpr const Shape* begin() { return nullptr; }
  static constexpr const Shape* end() { return nullptr; }
  static constexpr bool empty() { return true; }
  static constexpr std::size_t size() { return 0; }
  void push_back(const Shape&) {}
  void clear() {}
  static constexpr const Shape* data() { return nullptr; }
  const Shape& operator[](std::size_t i) const { return begin()[i]; }
  operator const std::vector<Shape>&() const {
    static const std::vector<Shape> none;
    return none;
  }
};

}  // namespace sim
"""
EDITS = [
    ("sim/scene.h", r"\}  // namespace sim\n$", FIXED.lstrip()),
    ("sim/fluid/step.h", r"\bOptions options_;", "OneScene options_;"),
    ("sim/fluid/liquid.cpp", r"\bOptions options_;", "OneScene options_;"),
    ("sim/colliders/solids.h", r"std::vector<Shape> shapes;", "NoShapes shapes;"),
    ("sim/fluid/advect.cpp", r"\bmethod == Advection::(rk2|rk3)\b", lambda m: "true" if m[1] == "rk2" else "false"),
    ("sim/transfer/grid_transfer_bodies.h", r"\brule\.flip\b", "false"),              # FLIP
    ("sim/transfer/lattice.h", r"std::array<bool, D> periodic(\{\})?;", "static constexpr std::array<bool, D> periodic{};"),   # periodic sides
    ("sim/transfer/lattice.h", r", periodic\(\w+\)", ""),
    ("sim/transfer/lattice.h", r"bool any_periodic = false;", "static constexpr bool any_periodic = false;"),
    ("sim/transfer/lattice.h", r", any_periodic = any_periodic \|\| periodic\[a\]", ""),
    ("sim/simulation.cpp", r'#include "sim/solid/solid.h"\n', ""),                    # solids
    ("sim/simulation.cpp", r"return scene\.options\.is_solid\(\) \? make_solid\(scene, fps\) : make_liquid\(scene, fps\);", "return make_liquid(scene, fps);"),
    ("cmake/options.cmake", r"-Werror", ""),                                          # what is left over may be unused
]
KEPT_OF_SOLIDS = {"material.cpp", "laws.h"}
DROPPED = ["sim/size.cpp", "sim/checkpoint.cpp"]

CMAKE = """cmake_minimum_required(VERSION 3.25)
project(one_scene LANGUAGES C CXX)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_EXTENSIONS OFF)
include(cmake/dependencies.cmake)
include(cmake/options.cmake)
add_subdirectory(base)
add_subdirectory(sim)
add_executable(driver tests/step_instructions.cpp)
target_link_libraries(driver PRIVATE polypic_sim)
"""


def instructions(words, folder):
    """(instructions inside the step, standard output)"""
    done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=" + STEP, *words], cwd=folder, capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or not found or int(found[1]) == 0:
        sys.exit(f"{' '.join(words)}: no instructions counted\n{done.stderr}")
    return int(found[1]), done.stdout


def make_bare_sources():
    for folder in ("base", "sim", "cmake"):
        shutil.copytree(os.path.join(source, folder), os.path.join(scratch, folder))
    os.mkdir(os.path.join(scratch, "tests"))
    shutil.copy(os.path.join(source, "tests/step_instructions.cpp"), os.path.join(scratch, "tests"))
    for name in os.listdir(os.path.join(scratch, "sim/solid")):
        if name not in KEPT_OF_SOLIDS and name.endswith(".cpp"):
            os.remove(os.path.join(scratch, "sim/solid", name))
    for name in DROPPED:
        os.remove(os.path.join(scratch, name))
    for name, pattern, text in EDITS:
        path = os.path.join(scratch, name)
        with open(path) as file:
            before = file.read()
        after, times = re.subn(pattern, text if callable(text) else lambda _: text, before)
        if times == 0:
            sys.exit(f"{name}: nothing like {pattern!r} is there any more: bring EDITS up to date")
        with open(path, "w") as file:
            file.write(after)
    with open(os.path.join(scratch, "CMakeLists.txt"), "w") as file:
        file.write(CMAKE)


def build_bare():
    build = os.path.join(scratch, "build")
    for words in (["cmake", "-S", scratch, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release"], ["cmake", "--build", build, "--parallel", str(os.cpu_count())]):
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(words)}\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return os.path.join(build, "driver")


def compare(what, first, second, allowed):
    apart = second / first - 1
    print(f"{what}: {first} and {second} instructions, {100 * apart:+.3f} % (allowed {100 * allowed:g} %)", flush=True)
    return abs(apart) <= allowed


def main():
    shutil.rmtree(scratch, ignore_errors=True)
    os.makedirs(scratch)
    counts = {}
    for name, text in (("plain", SHOT), ("unused", SHOT + UNUSED)):
        with open(os.path.join(scratch, name + ".toml"), "w") as file:
            file.write(text)
        counts[name], _ = instructions([program, "simulate", name + ".toml", "--threads", "1", "--quiet"], scratch)
    good = compare("without and with unused sections", counts["plain"], counts["unused"], 0.001)
    if len(sys.argv) < 5:
        sys.exit(0 if good else 1)
    make_bare_sources()
    whole, said = instructions([driver], scratch)
    bare, said_bare = instructions([build_bare()], scratch)
    good &= compare("without and with the other effects in the program", bare, whole, 0.01)
    if said != said_bare:
        print(f"the two do not do the same: {said_bare} {said}")
        good = False
    sys.exit(0 if good else 1)


main()
