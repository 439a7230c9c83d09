#pragma once
// What a shot costs on this machine, measured by the program itself: the shot is run a few frames long, with larger cells and smaller
// pictures. From how the costs of these micro-runs lie apart follows what the whole shot will cost (predict.h).
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "app/shot/shot.h"
#include "app/stages/film.h"

namespace app {

/// What one frame of a run cost.
struct FrameCost {
  double steps = 0;                     // since the frame before
  double speed = 0;                     // [m/s] of the fastest particle
  std::map<std::string, double> cpu;    // [s] of all threads, by "STAGE/PASS"; "STAGE/other" is what no pass counts
  std::map<std::string, double> calls;  // the same keys
  std::map<std::string, double> bytes;  // on disk, by stage and kind: "points", "surface", "images", "ledger"
};

struct MicroRun {
  double particles = 0, cell = 0;       // [1], [m]
  double pixels = 0, samples = 0;       // of a picture
  double peak_bytes = 0;
  std::map<std::int64_t, FrameCost> frames;
};

/// Three runs that differ in one size each, so that costs can be told apart: `small` and `wide` in the picture's, `wide` and `fine` in
/// the simulation's. `wide` has the first frames and the last, and of all between them steps and speed; so has `fine` where that was quick, without
/// a picture of the last.
struct Pilot {
  MicroRun small, wide, fine;
  std::int64_t last = 1;                // frame that the simulation was followed to
  double seconds = 0;                   // that measuring took, on the clock
};

/// At most this long [s]; a shot of which not even a coarse frame can be made in the time has no pilot.
inline constexpr double kLongestPilot = 60;
/// The simulation is followed to this frame at most; later ones are taken to cost the same.
inline constexpr std::int64_t kLastFollowed = 200;

/// Runs `program` on the shot's file in a folder of its own that is removed at the end. Empty where the time was not enough, a
/// micro-run failed, or nobody wants to know any more: `given_up` is asked now and then.
std::optional<Pilot> measure_pilot(const std::filesystem::path& program, const Shot&, const Overrides&, std::int64_t last_frame, int threads,
                                   const std::function<bool()>& given_up = [] { return false; });

/// Why there is none, from how long measuring took [s]: "small runs of this shot take more than a minute" or "a small run of this shot fails".
std::string why_no_pilot(double seconds);

/// The pilot of a shot like this one (other sizes are no difference) on this machine with this program, from the user's cache.
std::optional<Pilot> cached_pilot(const Shot&, std::int64_t last_frame, int threads);
/// Failing to keep it is no error: it is measured again.
void keep_pilot(const Shot&, int threads, const Pilot&);

/// $XDG_CACHE_HOME/polypic, or ~/.cache/polypic; empty where there is no home.
std::filesystem::path cache_folder();

}  // namespace app
