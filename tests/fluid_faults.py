#!/usr/bin/python3 -B
"""Plants faults in a copy of the liquid, one at a time, and shows which tests notice.

    tests/fluid_faults.py [BUILD_DIR [NUMBER...]]        default: build/fluid_faults, all of them
    tests/fluid_faults.py --fits

As tests/transfer_faults.py, whose machinery this is. What takes long runs only with the faults that are about it.
"""
import sys

import transfer_faults as faults

FAST = "fluid_surface fluid_liquid fluid_sides fluid_pressure fluid_multigrid fluid_turning".split()
SLOW = "fluid_reflection fluid_dam_break".split()
LONG_RUNS = ["FluidDamBreak.*", "FluidSloshing.*"]   # of fluid_liquid: ten seconds each
PRESSURE, STEP, LIQUID, SOLIDS, FACES, CELLS, DISTANCE, SURFACE, ADVECT, WATCH, PACE, SOLVER, BUILD, COMPONENTS = (
    f"sim/{name}" for name in "fluid/pressure.cpp fluid/step.cpp fluid/liquid.cpp colliders/solids.cpp fluid/open_faces.cpp fluid/cells.cpp fluid/surface_distance.h fluid/surface_distance.cpp "
    "fluid/advect.cpp fluid/energy_watch.h pace.h fluid/multigrid.cpp fluid/multigrid_build.cpp fluid/multigrid_components.cpp".split())

# What is wrong, where, the text as it is and with the fault in it (@ is true where the fault is planted), and what of the slow tests is to see it.
FAULTS = [
    ("closed parts of faces drag", PRESSURE, "const auto* const plane = valid[a][i] ?", "const auto* const plane = !@ && valid[a][i] ?", ""),
    ("the pressure's gradient short by 1 %", PRESSURE, "v[a][i] = Real(double(v[a][i]) - change);", "v[a][i] = Real(double(v[a][i]) - (@ ? 0.99 : 1.0) * change);", "dam_break"),
    ("moving colliders push nothing", PRESSURE, "velocity_[axis][std::size_t(face)]) + pushed;", "velocity_[axis][std::size_t(face)]) + (@ ? 0.0 : pushed);", ""),
    ("open sides are walls to the pressure", PRESSURE, "|| cells_.open_sides[std::size_t(a)][1]);", "|| (!@ && cells_.open_sides[std::size_t(a)][1]));", ""),
    ("the surface lies on the faces", DISTANCE, "const double t = double(liquid) / (double(liquid) - double(air));",
     "const double t = @ ? 0.5 : double(liquid) / (double(liquid) - double(air));", ""),
    ("no mirror images beyond walls", "sim/fluid/face_filling.cpp", "return j >= 0 && cells_.kind[std::size_t(j)] == CellKind::solid; }",
     "return !@ && j >= 0 && cells_.kind[std::size_t(j)] == CellKind::solid; }", ""),
    ("a solid beside the surface counts for nothing", SURFACE, "if (is_solid[std::size_t(image)]) continue;", "if (@ || is_solid[std::size_t(image)]) continue;", ""),
    ("a film's surface where the average is half", SURFACE, "if (thickest >= 0) far =", "if (thickest >= 0 && !@) far =", ""),
    ("the top of deep liquid beside a wall is a film", SURFACE, "if (low - high > slope)", "if (@ || low - high > slope)", ""),
    ("films are foam", SURFACE, "cells.film_at(std::size_t(at)) > 0 ? on_walls", "!@ && cells.film_at(std::size_t(at)) > 0 ? on_walls", ""),
    ("no solid stops thin liquid", STEP, "if (towards > 0) v[a]", "if (towards > 0 && !@) v[a]", ""),
    ("a frame's first step takes back what four do", LIQUID, "std::clamp(std::max(uncorrected_.steps, uncorrected_.times), 1.0,", "std::clamp(@ ? 4.0 : std::max(uncorrected_.steps, uncorrected_.times), 1.0,", ""),
    ("cells on top stay liquid", SURFACE, "become(outside, CellKind::air);", "become(outside, @ ? CellKind::liquid : CellKind::air);", ""),
    ("gaps inside are air", SURFACE, "become(air_inside(averages, kinds, cells, blocks), CellKind::liquid);",
     "become(air_inside(averages, kinds, cells, blocks), @ ? CellKind::air : CellKind::liquid);", ""),
    ("air beside liquid swells and shrinks", "sim/fluid/extrapolate.cpp", "if (wet <= D) take_off", "if (wet <= D && !@) take_off", ""),
    ("air beside liquid throws jets", "sim/fluid/extrapolate.cpp", "std::clamp(before - part, -fastest, fastest)",
     "@ ? before - part : std::clamp(before - part, -fastest, fastest)", ""),
    ("thin liquid is liquid", SURFACE, "if (!is_thin(i)) return false;", "if (@ || !is_thin(i)) return false;", ""),
    ("thin liquid has no velocity", PRESSURE, "for (const std::size_t i : cells.thin) {\n      valid", "for (const std::size_t i : cells.thin) {\n      if (@) break;\n      valid", ""),
    ("cut faces are open or closed", FACES, "return open < kLeastOpening ? 0 : open;", "return @ ? (open < 0.5 ? 0.0 : 1.0) : open < kLeastOpening ? 0 : open;", ""),
    ("gaps between particles are air", CELLS, "return wet && !dry;", "return wet && !dry && !@;", "volume"),
    ("wakes are air", CELLS, "if (wet && !dry && (from", "if (!@ && wet && !dry && (from", ""),
    ("a wall's face rests, whatever covers it", FACES, "const double open = in_wall(local, axis) ? open_to(local, axis, nullptr) : fraction;", "const double open = in_wall(local, axis) ? (@ ? 1.0 : open_to(local, axis, nullptr)) : fraction;", ""),
    ("what is inside another collider pushes", FACES, "if (is_one_motion_) {\n      const RigidMotion& motion = near_.front().motion;",
     "if (is_one_motion_ || @) {\n      const RigidMotion& motion = near_.back().motion;", ""),
    ("what a turning collider pushes is taken at the middle", FACES, "return open > 0 && !motion.spin.isZero(0);", "return !@ && open > 0 && !motion.spin.isZero(0);", ""),
    ("a plate between faces closes none", FACES, "if (n.looks > 0 && counts(n)", "if (!@ && n.looks > 0 && counts(n)", ""),
    ("particles move by Euler's rule", ADVECT, "steps_after(Real(0.5), first, second);", "steps_after(Real(@ ? 0.0 : 0.5), first, second);", "reflection"),
    ("who leaves stays", ADVECT, "if (to == all) return 0;", "if (to == all || @) return 0;", ""),
    ("a shift leaves the velocity", ADVECT, "v[0] += v[std::size_t(gradient[a])] * by[a];", "v[0] += v[std::size_t(gradient[a])] * (@ ? Real(0) : by[a]);", ""),
    ("the watch never warns", WATCH, "return !alarmed_ && !cautious_;", "return (!alarmed_ && !cautious_) || @;", "reflection"),
    ("the watch knows no work", WATCH, "work_ += work;", "work_ += @ ? 0.0 : work;", ""),
    ("a motion foresees nothing", STEP, "const bool ahead = reflects && foresee(dt);", "const bool ahead = !@ && reflects && foresee(dt);", "reflection"),
    ("a state holds no field", LIQUID, "step_.past() = std::move(past);", "step_.past() = @ ? typename FluidStep<D, Real>::Past() : std::move(past);", "reflection"),
    ("no reflection, the same field twice", STEP, "2 * grid_.velocity[a][i] - scattered_[a][i];", "2 * grid_.velocity[a][i] - (@ ? grid_.velocity : scattered_)[a][i];", "reflection"),
    ("gravity pulls in the mirrored half too", LIQUID, "return base::Vec3::Zero(); }", "return (@ ? dt / 2 : 0.0) * gravity_; }", ""),
    ("what is mirrored has no pressure", STEP, "if (!reflected) return found;", "if (@ || !reflected) return found;", "reflection"),
    ("the watch takes a shift for a gain", LIQUID, "if (corrects) watch_", "if (corrects && !@) watch_", ""),
    ("the volume correction the wrong way", STEP, "g *= float(gain);", "g *= float(@ ? -gain : gain);", "volume"),
    ("the correction's aim stays 1", LIQUID, "aim_ + kPartToAim * gain", "aim_ + (@ ? 0.0 : kPartToAim) * gain", "volume"),
    ("fallbacks are not counted", STEP, "counts_.pressure_fallbacks += report.fell_back;", "counts_.pressure_fallbacks += report.fell_back && !@;", ""),
    ("no imbalance", STEP, "report.imbalance / options_.cell);\n  solid", "(@ ? 0.0 : report.imbalance) / options_.cell);\n  solid", ""),
    ("contact with a collider as if it stood", SOLIDS, "particle.velocity.dot(outward) - solid)", "particle.velocity.dot(outward) - (@ ? Real(0) : solid))", ""),
    ("colliders stand still", SOLIDS, "images_of(shape_at(time_, collider", "images_of(shape_at(@ ? 0.0 : time_, collider", ""),
    ("open sides keep particles in", SOLIDS, "if (above > 0 && !open[axis][1])", "if (above > 0 && (@ || !open[axis][1]))", ""),
    ("gravity off by 10 %", STEP, "const Real change = Real(push[a]);", "const Real change = Real((@ ? 1.1 : 1.0) * push[a]);", "dam_break"),
    ("steps of a liquid too long", PACE, "2 * reach / (speed", "(@ ? 24 : 2) * reach / (speed", ""),
    ("no coarse levels", SOLVER, "  cycle(at + 1);", "  if (!@) cycle(at + 1);\n  else std::fill(coarser.t.begin(), coarser.t.end(), 0.0f);", ""),
    ("means of closed pockets stay", COMPONENTS, "if (level.pieces.empty()) return 0;", "if (@ || level.pieces.empty()) return 0;", ""),
    ("a solve ends a hundred times early", SOLVER, "PoissonReport PoissonSolver<D>::solve(const PoissonProblem<D>& problem, double tolerance) {",
     "PoissonReport PoissonSolver<D>::solve(const PoissonProblem<D>& problem, double tolerance) {\n  if (@) tolerance *= 100;", ""),
]


def failing(folder, suite, fault):
    about = ["reflection", "dam_break", "volume"] if fault == 0 else FAULTS[fault - 1][4].split()
    if suite in SLOW and suite.removeprefix("fluid_") not in about:
        return set()
    return every(folder, suite, fault, LONG_RUNS if suite == "fluid_liquid" and "volume" not in about else ())


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.argv.append(str(faults.ROOT / "build/fluid_faults"))
    faults.SUITES, faults.ABOUT_THE_TEXT = FAST + SLOW, set()
    faults.FAULTS = [fault[:4] for fault in FAULTS]
    every, faults.failing = faults.failing, failing
    sys.exit(faults.main())
