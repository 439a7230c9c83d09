#!/usr/bin/python3 -B
"""Switches cures off in a copy of the simulation, one at a time, and shows which hard cases notice.

    tests/verify_faults.py [BUILD_DIR [NUMBER...]]        default: build/verify_faults, all of them
    tests/verify_faults.py --fits

As tests/transfer_faults.py, whose machinery this is: the copy is built once with all faults in it, each behind a number that the environment
chooses. Prints a line a cure: its number, what is off, the cases that fail. Exits 1 when no case that is about a cure
notices, or one of them fails with all cures on.
"""
import os
import pathlib
import re
import subprocess
import sys

import transfer_faults as faults

GATHER, SOLIDS, PRESSURE, DISTANCE, COMPONENTS, STEP, LIQUID, WATCH, SAND, SNOW, SOLID_STEP, SEEDING, VIOLATION, BLAME = (
    f"sim/{name}" for name in "solid/gather.cpp colliders/solids.cpp fluid/pressure.cpp fluid/surface_distance.h fluid/multigrid_components.cpp fluid/step.cpp "
    "fluid/liquid.cpp watch.cpp solid/drucker_prager.h solid/snow.h solid/step.cpp solid/seeding.cpp violation.cpp blame.cpp".split())

# What is off, where, the text as it is and without the cure (@ is true where it is off), and the cases that must notice.
FAULTS = [
    ("the limiter", GATHER, "if (limits_it)\n    factor = limiting_factors", "if (limits_it && @) factor.fill(Real(1));\n  else if (limits_it)\n    factor = limiting_factors",
     "spinning_disk/2d/polypic9"),
    ("hybrid carry beside light nodes", GATHER, "lightest < Real(kLightNode * group.weight)", "lightest < Real((@ ? 0.0 : kLightNode) * group.weight)", "spinning_disk/2d/polypic9/hybrid"),
    ("the null space of closed pockets", COMPONENTS, "if (level.pieces.empty()) return 0;", "if (@ || level.pieces.empty()) return 0;", "piston_into_a_full_box"),
    ("the least theta at the surface", DISTANCE, "return t < kLeastTheta ? kLeastTheta :", "return !@ && t < kLeastTheta ? kLeastTheta :", "surface_at_a_cells_middle"),
    ("the cap of snow's hardening", SNOW, "const T cap = constant<T>(std::log(most_hardening));", "const T cap = constant<T>(@ ? 1e3 : std::log(most_hardening));", "snow_hardening"),
    ("the node's least mass, a millionth of a millionth in place of 1e-28", SOLID_STEP, "const bool valid = double(mass) > kLightestNode;",
     "const bool valid = double(mass) > (@ ? 1e-12 : kLightestNode);", "translation_1000_cells"),
    ("sand's memory of the volume it gained", SAND, "state = smaller(gained, constant<T>(kMostGain));", "state = @ ? T(0) : smaller(gained, constant<T>(kMostGain));", "sand_at_the_tip shaken_sand"),
    ("loose particles' shorter steps", GATHER, "constexpr double kLooseFactor = 1.5;", "const double kLooseFactor = @ ? 0.05 : 1.5;", "lone_particle"),
    ("a stop at thin colliders", SOLIDS, "if (length == 0 ||", "if (@ || length == 0 ||", "thin_wall"),
    ("steps as short as motion asks", LIQUID, "const double reach = options_.cfl * options_.cell;", "const double reach = (@ ? 40.0 : 1.0) * options_.cfl * options_.cell;", "fast"),
    ("the end of a collapse of steps", LIQUID, "if (dt < left && dt < kShortestStep / fps_)", "if (!@ && dt < left && dt < kShortestStep / fps_)", "step_collapses/fast_liquid"),
    ("the energy that the watch sees", WATCH, "if (free - now.least >", "if (!@ && free - now.least >", "spinning_disk/2d/polypic9/fixed"),
    ("particles kept out of colliders", SOLIDS, "if (depth <= 0) continue;", "if (@ || depth <= 0) continue;", "overlapping_at_start closing_colliders"),
    ("particles kept inside walls", SOLIDS, "if (above > 0 && !open[axis][1])", "if (!@ && above > 0 && !open[axis][1])", "into_a_wall"),
    ("who leaves is counted", STEP, "counts_.left += left;", "counts_.left += @ ? 0 : left;", "emptied_half_way"),
    ("closed faces stand still", PRESSURE, "v[a][i] = moves ? Real(cells.open.pushed(a, i)) : Real(0);", "v[a][i] = @ ? v[a][i] : moves ? Real(cells.open.pushed(a, i)) : Real(0);", "full_box"),
    ("the imbalance is told", STEP, "report.imbalance / options_.cell);\n  solid", "(@ ? 0.0 : report.imbalance) / options_.cell);\n  solid", "piston_into_a_full_box"),
    ("the volume correction", LIQUID, "const bool corrects = options_.volume_correction > 0", "const bool corrects = !@ && options_.volume_correction > 0", "blocks_fall_into_a_pool"),
    ("cut faces seen by their open part", PRESSURE, "v[a][face] = velocity;", "if (!@) v[a][face] = velocity;", "funnel"),
    ("what is piled up before a collider is let out", "sim/fluid/surface_distance.cpp", "if (cells.open.cut(i, blocks)) {", "if (!@ && cells.open.cut(i, blocks)) {", "funnel"),
    ("changes of volume averaged against locking", SEEDING, "group.averages = body.solid.volume_averaging;", "group.averages = !@ && body.solid.volume_averaging;", "beam"),
    ("momentum handed over where bodies touch", "sim/solid/step.cpp", "bodies_.apply(blocks_, groups, grid_);", "if (!@) bodies_.apply(blocks_, groups, grid_);", "balls_on_balls"),
]
# The same of the watch: what its tests must notice.
WATCH_SUITES = ["test_watch", "test_watch_retries"]
WATCH_FAULTS = [
    ("mass after P2G", VIOLATION, "if (!(std::abs(grid.mass[a] - particles.mass[a])", "if (!@ && !(std::abs(grid.mass[a] - particles.mass[a])"),
    ("momentum after P2G", VIOLATION, "if (!(std::abs(grid.momentum[a] - particles.momentum[a])", "if (!@ && !(std::abs(grid.momentum[a] - particles.momentum[a])"),
    ("finite sums", WATCH, "if (!std::isfinite(energy) || !std::isfinite(t.max_speed) || !t.linear_momentum.allFinite())",
     "if (!@ && (!std::isfinite(energy) || !std::isfinite(t.max_speed) || !t.linear_momentum.allFinite()))"),
    ("a count of particles", WATCH, "if (double(t.particles) != now.particles)", "if (!@ && double(t.particles) != now.particles)"),
    ("work that gravity does", WATCH, "const double work = t.collider_work + t.gravity_work + t.poured_energy;",
     "const double work = t.collider_work + (@ ? 0 : t.gravity_work) + t.poured_energy;"),
    ("the largest coefficient", WATCH, "if (t.mass > 0 && t.largest_coefficient >", "if (!@ && t.mass > 0 && t.largest_coefficient >"),
    ("the volume ratios", WATCH, "if (t.least_volume && !(std", "if (!@ && t.least_volume && !(std"),
    ("going back to a step's start", WATCH, "simulation_->go_back(*start);", "if (!@) simulation_->go_back(*start);"),
    ("shorter steps", WATCH, "  restraint_.halvings = halvings;", "  restraint_.halvings = @ ? 0 : halvings;"),
    ("a limit to steps as long as the frame", WATCH, "restraint_.longest = span / (1 << halvings);", "if (!@) restraint_.longest = span / (1 << halvings);"),
    ("restrained modes", WATCH, "restraint_.modes = std::max(restraint_.modes, halvings - 1);", "if (!@) restraint_.modes = std::max(restraint_.modes, halvings - 1);"),
    ("steps that are as long as ever afterwards", WATCH, "if (restraint_.halvings == 0) continue;", "if (@ || restraint_.halvings == 0) continue;"),
    ("all of the frame once more", WATCH, "      return again(before, ledger, interrupted);\n    } catch (const base::Error& stays) {\n      if (!is_unstable(stays) ||",
     "      return again(before, ledger, interrupted);\n    } catch (const base::Error& stays) {\n      if (@ || !is_unstable(stays) ||"),
    ("the end of going back", WATCH, ">= kMostRetriesOfARun) stop(", ">= (@ ? 1e9 : kMostRetriesOfARun)) stop("),
    ("since when", WATCH, "memory_.since = retries_ == 0 ? 0 : before.since > 0 ? before.since :", "memory_.since = retries_ == 0 ? 0 : !@ && before.since > 0 ? before.since :"),
    ("the id of the largest coefficient", BLAME, "found.row = std::size_t(std::lower_bound(f.id.begin(), f.id.end(), id[found.row]) - f.id.begin());",
     "if (!@) found.row = std::size_t(std::lower_bound(f.id.begin(), f.id.end(), id[found.row]) - f.id.begin());"),
]


def main():
    faults.FAULTS = [f[:4] for f in FAULTS + WATCH_FAULTS]
    if faults.fits():
        return 0
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else faults.ROOT / "build/verify_faults").resolve()
    copy, built = folder / "source", folder / "build"
    copy.mkdir(parents=True, exist_ok=True)
    faults.plant(copy)
    run = lambda *words: subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    run("cmake", "-S", str(copy), "-B", str(built), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release")
    run("cmake", "--build", str(built), "--parallel", "2", "--target", "test_verify_cases", *WATCH_SUITES)
    bad = 0

    def failing(number, words):
        environment = dict(os.environ, POLYPIC_FAULT=str(number), POLYPIC_CASES=" ".join(words))
        try:
            result = subprocess.run([built / "tests/test_verify_cases"], capture_output=True, text=True, env=environment, timeout=100)
        except subprocess.TimeoutExpired:   # a collapse that nobody ends: a case that never does has not passed
            return ["a case without end"], ""
        return re.findall(r"^FAIL (\S+)", result.stdout, re.M), result.stdout

    chosen = [int(n) for n in sys.argv[2:]] or range(1, len(FAULTS + WATCH_FAULTS) + 1)
    for number in chosen:
        if number > len(FAULTS):
            name, file, _, _ = WATCH_FAULTS[number - len(FAULTS) - 1]
            found = sorted(set().union(*(faults.failing(built, suite.removeprefix("test_"), number) for suite in WATCH_SUITES)))
            print(f"{number:2} without {name} ({pathlib.Path(file).name}): {', '.join(found) or 'NOTHING FAILS'}", flush=True)
            bad += not found
            continue
        name, file, _, _, about = FAULTS[number - 1]
        whole, _ = failing(0, about.split())
        found, text = failing(number, about.split())
        if whole:
            print(f"without a fault these fail: {' '.join(whole)}")
        print(f"{number:2} without {name} ({pathlib.Path(file).name}): {', '.join(found) or 'NOTHING FAILS'}", flush=True)
        bad += not found or bool(whole)
    print(f"\n{len(chosen)} cures, {bad} of which can be off without their case noticing")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
