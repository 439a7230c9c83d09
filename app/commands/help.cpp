#include "app/commands/help.h"

#include <algorithm>
#include <map>

#include "sim/problem.h"

namespace app {
namespace {

constexpr std::string_view kFirstPage = R"(polypic turns a shot file into a film: a PolyPIC liquid, surfaced and path traced.

  polypic run SHOT         the whole film: out/NAME/movie.mp4
  polypic simulate SHOT    particles only:    points/points.0001.vdb
  polypic surface SHOT     points -> surface: surface/surface.0001.vdb
  polypic render SHOT      surface -> images: images/beauty.0001.exr and .png, movie.mp4

  polypic plan SHOT        what a shot asks for and what it will cost
  polypic cost SHOT        what more or less accuracy would cost in time; also cost PROBLEM
  polypic list             shots, materials, looks and problems that come with the program
  polypic info FILE        what is in a .vdb, .exr, .png, .mp4, .h5, .json, .toml, .html or mesh
  polypic diff A B         how far two images, .vdb files or runs lie apart
  polypic sheet RUN...     pictures of several runs side by side, with labels
  polypic params [TOPIC]   every key of a shot file: unit, default, range, meaning
  polypic verify [CASE...] hard cases, and whether what must hold does

SHOT is a TOML file, or the name of a shot in the list. polypic COMMAND --help says more.

Your first film, then one of your own:
  polypic run dam_break
  polypic params --example > mine.toml && polypic run mine.toml --quality draft
)";

constexpr std::string_view kShotOptions = R"(
  --out DIR           the run's directory (default: out/NAME, NAME being the shot's file name)
  --frames A-B, or A  these frames only; B may go past the shot's last. A simulation starts at frame 1
  --set KEY=VALUE     changes a key of the shot, as often as you like: --set sim.cell=0.01
  --quality Q         draft, normal, high or extreme
  --threads N         default: all cores. The result is the same for any number
  --no-report         report.html is not written
  --restart           forgets what this command and those after it have made, all frames of it, and
                      makes it anew
  --quiet             no progress
  --json              run.json's content on standard output, all else on standard error
)";

constexpr std::string_view kPreviewOption = "  --preview           ";

std::string problems_text() {
  std::string text = "\nPROBLEM is one of\n";
  for (const sim::ProblemRow& row : sim::problem_rows())
    text += "  " + std::string(row.name) + std::string(20 - std::min<std::size_t>(19, row.name.size()), ' ') + std::string(row.meaning) + "\n";
  return text;
}

const std::map<std::string_view, std::string> kPages = {
    {"run", std::string(R"(polypic run SHOT [options]     simulates, surfaces and renders, frame by frame, then makes the movie

Frames that are finished are kept: the same command goes on where it was stopped. A shot without [render] ends with its surfaces.
report.html in the run's directory shows frames, energy, volume and momentum over time and seconds by pass, on one page.
)") + std::string(kShotOptions) + std::string(kPreviewOption) + R"(also draws quick previews: preview/preview.0001.png, preview.mp4

  polypic run dam_break
  polypic run mine.toml --quality draft --preview
  polypic run mine.toml --frames 40-48 --set render.spp=64 --out out/closer
)"},
    {"simulate", std::string(R"(polypic simulate SHOT [options]     moves the particles and writes points/points.0001.vdb ...
)") + std::string(kShotOptions) + R"(
  polypic simulate mine.toml
  polypic simulate mine.toml --frames 24 --json > run.json
)"},
    {"surface", std::string(R"(polypic surface SHOT [options]     turns points into a level set, surface/surface.0001.vdb ...
)") + std::string(kShotOptions) + R"(
  polypic surface mine.toml
  polypic surface mine.toml --restart --set surface.voxel=0.005
)"},
    {"render", std::string(R"(polypic render SHOT [options]     path traces the surface: images/beauty.0001.exr and .png ..., movie.mp4
)") + std::string(kShotOptions) + std::string(kPreviewOption) + R"(draws quick previews instead, of what [preview] says; needs the points only, or the surface where that is
drawn

  polypic render mine.toml --frames 12
  polypic render mine.toml --restart --set render.spp=256
)"},
    {"plan", R"(polypic plan SHOT [options]     what a shot asks for and what it will cost, before it is made

Each effect on or off and the key that decides, what a particle holds, the passes. Then small runs of the shot are measured, in a minute at
most (once: they are kept in $XDG_CACHE_HOME/polypic), and say what CPU time, memory and disk the whole will take. What cannot fit is refused.

  --frames, --set, --quality, --threads, --out, --quiet    as in polypic run
  --graph FILE.svg    a picture of the passes: what each reads and writes
  --json              {effects, attributes, bytes_per_particle, passes, particles, cells, predicted}; seconds are those of a frame's CPU

  polypic plan dam_break
  polypic plan mine.toml --set sim.cell=0.005 --frames 1-24 --graph passes.svg
)"},
    {"cost", R"(polypic cost SHOT|PROBLEM [options]     what accuracy costs in time: variants side by side, error against seconds

Variants of a shot are run at a half and a quarter of its resolution and compared with the shot as it is; PROBLEM has a known answer. Each variant
runs in a process of its own, several times in turns. What is measured is kept: the same command measures only what is missing. Written are
cost.csv, cost.json, report.html (one page, no network needed) and its plots as plots/*.svg and *.png. Exit code 6: a variant could not run.

  --vary KEY=V1,V2    tries every value, of several keys all combinations (default: the ladder of schemes, from PIC to PolyPIC)
  --refine KEY=V1,V2  of a problem: every variant at every value, and how long each takes to come to an error
  --error KIND        ranks by energy, position, vorticity, volume, surface, image or velocity (default: the subject's own)
  --set KEY=VALUE     changes a key of all variants; problem.KEY of a problem
  --quality Q         draft, normal, high or extreme: of the shot that the others are compared with
  --frames 1-N        of a shot: the frames that are simulated (default: all)
  --repeats N         runs of each variant's clock (default: 3 of a problem, 2 of a shot)
  --out DIR           default: out/cost/NAME
  --threads N         default: all cores
  --dry-run           names the variants, how many runs they take and about how long, and runs none of them
  --single            runs a problem once as --set makes it, and prints what it measured as JSON
  --quiet, --json     no progress; cost.json's content on standard output

  polypic cost taylor_green_2d
  polypic cost taylor_green_2d --vary sim.modes=1,3,4,6,9 --set sim.kernel=quadratic --set problem.waves=8
  polypic cost taylor_green_2d --refine sim.cell=0.0625,0.03125,0.015625 --error velocity --set problem.mean=[0.16,0.1]
  polypic cost shots/dam_break.toml --frames 1-24
)" + problems_text()},
    {"list", R"(polypic list [--json]     shots, materials, looks and problems that come with the program
)"},
    {"info", R"(polypic info FILE [--json]     what is in a file

  polypic info out/dam_break/surface/surface.0012.vdb
  polypic info out/dam_break/images/beauty.0012.exr
  polypic info shots/bowl.obj     bounds, triangles, and whether it is closed, as bodies and colliders must be
)"},
    {"diff", R"(polypic diff A B [options]     how far two results lie apart; exit code 0: the same, 6: they differ

A and B are two images, two .vdb files (a surface voxel by voxel, points by id) or two run directories, which are compared
frame by frame and stage by stage. How long a run took is no difference.

  --fail X            a value fails when it differs by more than X, in its own unit (default: 0)
  --fail-percent P    up to P percent of the pixels, voxels or particles may fail (default: 0)
  --out FILE.png      a picture of the difference of two images
  --json              {same, kind, mean, rms, max, psnr, percent_over, ...}; what does not apply is absent

  polypic diff out/before out/after
  polypic diff a.png b.png --fail 0.02 --fail-percent 0.5 --out difference.png
  polypic diff coarse/surface/surface.0012.vdb fine/surface/surface.0012.vdb --fail 0.001
)"},
    {"sheet", R"(polypic sheet RUN... [options]     pictures of several runs side by side on one sheet

RUN is a run's directory; its label says name, transfer, frame, time and the seconds that simulating took. Previews are shown where
every run has them, else the film's pictures. PNG files instead of runs are labelled with their names.

  --frames N          the frame (default: the last that all runs have)
  --out FILE.png      default: sheet.png
  --json              {file, width, height, labels}

  polypic sheet out/pic out/apic out/polypic --frames 24 --out compared.png
  polypic sheet out/dam_break/images/*.png          one run over time
)"},
    {"verify", R"(polypic verify [CASE...] [options]     hard cases of the method: exit code 0 when all pass, 6 when one does not

CASE is a name, its beginning up to a slash ("dam_break", "spinning_disk/2d"), or a pattern: "still_water*", "*/polypic27/*". Every case says
what must hold, to what tolerance and who says so; one that must fail passes when it fails as said. docs/stability/cases.md lists them all.

  --quick             without the few that take longer than seconds
  --list              names and expectations, and nothing is run; with --json all that is known of them beforehand
  --out DIR           for report.html (table, energy curves, pictures) and verify.json (default: out/verify)
  --threads N         default: all cores; several cases run at a time
  --quiet             no line a case
  --json              {cases: [{name, dimension, transfer, kernel, integrator, expect, outcome, value, tolerance, source, passed}], passed, failed}

  polypic verify --quick
  polypic verify dam_break "spinning_*" --out out/some
)"},
    {"params", R"(polypic params [TOPIC] [--example] [--json]     the keys of a shot file

TOPIC is a table, a key or a choice of one ("gravity"), or a problem of `polypic cost`: its own keys. --example prints a complete shot that runs.

  polypic params sim
  polypic params render.spp
  polypic params --example > mine.toml
)"},
};

}  // namespace

std::string help_text(std::string_view command) {
  const auto page = kPages.find(command);
  return page == kPages.end() ? std::string(kFirstPage) : page->second;
}

}  // namespace app
