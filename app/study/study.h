#pragma once
// What accuracy costs: the variants of one shot, or of one problem with a known answer, side by side. Filled by the engine (cost.h), written as
// cost.csv and cost.json, drawn by the report.
//
// Errors are relative numbers unless they say otherwise, and never negative. One that does not apply, or that is no larger than what another seed
// changes, is absent.
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace app {

/// Kinds of error, in the order of the columns of cost.csv.
enum class Measure { energy, position, vorticity, volume, surface, image, velocity };
inline constexpr std::array<std::string_view, 7> kMeasureNames{"energy", "position", "vorticity", "volume", "surface", "image", "velocity"};

/// None where there is no such kind.
inline std::optional<Measure> measure_named(std::string_view name) {
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (kMeasureNames[m] == name) return static_cast<Measure>(m);
  return {};
}

struct Errors {
  std::array<std::optional<double>, kMeasureNames.size()> value;
  std::optional<double>& operator[](Measure m) { return value[static_cast<std::size_t>(m)]; }
  const std::optional<double>& operator[](Measure m) const { return value[static_cast<std::size_t>(m)]; }
};

/// Energy and enstrophy over those at the start; of shots no enstrophy.
struct Course {
  std::vector<double> time;        // [s]
  std::vector<double> energy;      // [1], as long as `time`
  std::vector<double> enstrophy;   // [1], as long as `time` or empty
};

/// What one pass cost in a whole run: of the run with the median of the clock's seconds, and of that with the median of CPU seconds.
struct PassTime {
  std::int64_t calls = 0;
  double seconds = 0, cpu_seconds = 0;
};

/// A picture of one frame of a variant.
struct Picture {
  std::int64_t frame = 1;
  std::filesystem::path file;      // .png
};

struct Variant {
  std::string label;               // short and unique within its case: "polypic full linear, reflection"
  std::string scheme;              // the label without what was refined: what variants of one line of a plot have in common
  std::string part;                // name of the case it belongs to (Study::cases); never empty
  std::vector<std::pair<std::string, std::string>> keys;   // what was varied: "sim.transfer", "polypic"
  // As run:
  std::string transfer, modes, kernel, splitting;          // modes is empty but for polypic; splitting is empty for solids
  double cell = 0, cfl = 0;        // [m], [1]
  std::int64_t particles = 0, steps = 0;

  std::string failure;             // the line that says why it could not run; empty when it did. Then nothing below is set
  Errors errors;
  std::vector<double> seconds;     // wall clock of each repeat [s], in the order they ran
  double seconds_median = 0, seconds_min = 0, seconds_max = 0;
  double cpu_seconds = 0;          // median
  std::map<std::string, PassTime> passes;                  // by name: sort, p2g, pressure ...
  std::map<std::string, double> energy_changes;            // by stage, over the energy at the start [1]: losses are negative
  Course course;
  std::int64_t peak_bytes = 0, disk_bytes = 0;
  bool pareto = false;             // nothing else of its case is both nearer to the truth and faster
  std::vector<std::string> ties;   // labels of variants of the same case that are as fast within the measured spread
  std::vector<Picture> pictures;   // shots only; the same frames for all variants
  bool ran() const { return failure.empty(); }
};

/// How long it takes schemes that were refined to come to an error, of the kind that decides.
struct TimeToError {
  struct Reach {
    double seconds = 0;            // [s]
    bool at_most = false;          // the fastest variant has less error, and no coarser one was tried
  };
  struct Row {
    std::string scheme;
    std::vector<std::optional<Reach>> reaches;   // by level; none: nothing that was tried comes to it
  };
  std::vector<double> levels;      // falling
  std::vector<Row> rows;           // of schemes that ran, in the order of the ladder
};

/// Variants that are compared with each other: one value of the problem's own parameters, or the shot at one resolution and the other.
struct StudyCase {
  std::string name;                // "8 cells a wavelength"; "dam_break"
  Measure decides = Measure::energy;                       // the error that fronts and sentences are about
  std::array<std::string, 3> sentences;                    // the best value, what the next rung costs, what the rung below loses; or of `times`
  Errors noise;                    // of shots: the distance between two runs of the reference with different seeds
  TimeToError times = {};          // without levels unless schemes were refined
};

struct Study {
  std::string subject;             // "taylor_green_2d", "dam_break"
  std::string title;               // one sentence: what is run, and what the errors are measured against
  bool is_shot = false;
  std::string command;             // that made it
  std::string version, commit;     // of the program
  int threads = 1, repeats = 1;
  std::string processor;           // as it calls itself
  int cores = 1;                   // of the machine
  std::array<std::string, kMeasureNames.size()> meaning;   // of each kind of error, with its unit; empty where no variant has one
  std::vector<StudyCase> cases;
  bool is_refined = false;         // every scheme was tried at several values of some keys
  std::vector<Variant> variants;   // in the order of the ladder, case by case
  std::optional<Variant> reference;                        // of shots
  std::vector<std::string> notes;  // what was chosen: frames, resolutions, up to which frame errors are errors and not chance
};

}  // namespace app
