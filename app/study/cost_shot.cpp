// Studies of shots: variants at a half and a quarter of the resolution, against the shot as it is.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/plan/predict.h"
#include "app/stages/stopwatch.h"
#include "app/study/coarser.h"
#include "app/study/distance.h"
#include "app/study/front.h"
#include "app/study/shot_runs.h"
#include "app/study/trials.h"
#include "base/error.h"
#include "base/text.h"
#include "render/render.h"
#include "sim/size.h"

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr int kRepeats = 2;
constexpr double kStart = 0.3;                        // [s] of a process, before and after what it measures
constexpr std::size_t kFrames = 8, kPictures = 4;     // that are compared, and drawn
constexpr double kCompared = 5e-6, kComparedFlat = 1.6e-6;   // [s] a particle and frame on one thread: sorted along 48 directions, or 16
constexpr double kTrusted = 0.5;                      // of the variants' error: where chance makes more, frames are compared no more

/// At most `count` frames up to the last, evenly spread, the first left out: nothing has happened there.
std::vector<std::int64_t> spread_frames(std::int64_t last, std::size_t count) {
  std::vector<std::int64_t> frames;
  for (std::size_t k = 1; k <= count; ++k) {
    const std::int64_t frame = std::max<std::int64_t>(1, std::llround(double(last) * double(k) / double(count)));
    if (frames.empty() || frames.back() != frame) frames.push_back(frame);
  }
  return frames;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? 0 : sum / double(values.size());
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Errors that compare frame with frame.
constexpr std::array kByFrame{Measure::position, Measure::vorticity, Measure::surface, Measure::image};

class ShotStudy {
 public:
  ShotStudy(const fs::path& file, const CostOrder& order, base::Progress& progress)
      : file_(file),
        order_(order),
        progress_(progress),
        shot_(read_shot(file, order.overrides)),
        last_(order.frames ? order.frames->last : shot_.frames) {
    if (order.frames && order.frames->first != 1)
      throw base::Error({.file = "--frames", .hint = "as in --frames 1-24", .message = "must begin with 1: a simulation starts there"});
    for (const Varied& varied : order.vary)
      if (varied.key == "shot.fps") throw base::Error({.file = "--vary shot.fps", .message = "frames of one number would be of different times"});
    if (!order.refine.empty())
      throw base::Error({.file = "--refine " + order.refine.front().key, .hint = "--vary sim.cell=V1,V2 asks for others", .message = "is for problems: a shot is tried on two sizes of cells as it is"});
    if (order.decides) refuse_unknown_error(*order.decides);
    if (last_ < 2) throw base::Error({.file = "--frames", .message = "must reach to frame 2 at least: nothing has moved before"});
    if (shot_.has_pictures) more_ = {"render.width=480", "render.height=270"};
    if (shot_.has_pictures && shot_.scene.options.dimension == 3) more_.push_back("render.spp=16");
    compared_ = spread_frames(last_, kFrames);
    pictures_ = spread_frames(last_, kPictures);
  }

  Study make() {
    study_.subject = shot_.name;
    study_.is_shot = true;
    study_.title =
        fmt::format("{}, frames 1 to {}, against the shot as it is with a cell of {} m", shot_.name, last_, base::to_text(shot_.scene.options.cell));
    const int repeats = order_.repeats.value_or(kRepeats);
    sign(study_, order_, repeats);
    study_.cases = {{shot_.name, order_.decides.value_or(Measure::position), {}, {}}};
    plan_variants();
    plan_references();
    refuse_idle_quality();
    TrialRuns runs = runs_of(repeats);
    runs.audit = [&](const Trial& t, int, std::string& failure) { return audited(t, failure); };
    tell_plan(variants_, runs, shot_.name, order_.dry_run, progress_);
    progress_.line("       " + study_.notes.front() + "; and the shot as it is, twice");
    if (order_.dry_run) {
      tell_predicted_time(runs);
      return study_;
    }
    run_trials(references_, runs_of(1), progress_);
    keep_sizes(references_);
    const Stopwatch watch;
    const std::int64_t drawn = make_pictures(references_);
    const double a_picture = drawn > 0 ? watch.seconds() / double(drawn) : predicted_picture(cached_pilot(shot_, last_, order_.threads));
    for (const Trial& t : references_)
      if (!t.variant.ran())
        throw base::Error({.file = file_.string(), .hint = "the reference is the shot's own settings", .message = t.variant.failure});
    runs.known = KnownRun{references_.front().variant.seconds_median, kStart, size_of(references_.front())};
    runs.besides = seconds_besides(missing_pictures(variants_), a_picture);
    run_trials(variants_, runs, progress_);
    keep_sizes(variants_);
    make_pictures(variants_);
    compare();
    study_.reference = references_.front().variant;
    for (Trial& t : variants_) study_.variants.push_back(t.variant);
    judge(study_);
    return study_;
  }

 private:
  fs::path folder_of(const Trial& t) const { return order_.out / "runs" / t.hash; }
  ShotRun run_of(const Trial& t, const fs::path& out) const {
    ShotRun run{file_, out, order_.overrides, last_, order_.threads};
    for (const auto* list : {&more_, &t.sets}) run.overrides.sets.insert(run.overrides.sets.end(), list->begin(), list->end());
    return run;
  }

  void refuse_unknown_error(Measure m) const {
    const bool is_liquid = !shot_.scene.options.is_solid();
    const bool is_known = m == Measure::volume ? is_liquid : m == Measure::surface ? has_surface() && shot_.has_pictures : m == Measure::image ? shot_.has_pictures : m != Measure::velocity;
    if (!is_known) throw base::Error({.file = "--error " + std::string(kMeasureNames[std::size_t(m)]), .message = "the shot has no such error"});
  }

  /// Reads the trial's shot; its complaint where it is none.
  std::optional<base::Complaint> prepare(Trial& t) const {
    t.variant.part = shot_.name;
    try {
      const Shot shot = read_shot(file_, run_of(t, {}).overrides);
      const sim::Options& o = shot.scene.options;
      const SchemeNames names = scheme_names(o);
      t.variant.transfer = names.transfer, t.variant.kernel = names.kernel, t.variant.modes = names.modes, t.variant.splitting = names.splitting;
      t.variant.cell = o.cell, t.variant.cfl = o.cfl;
      if (t.variant.label.empty()) t.variant.label = label_of(o, t.variant.keys);
      t.text = stage_text(shot, "simulate");
      t.hash = trial_hash(t.text, fmt::format("{} {}", last_, order_.threads));
      return {};
    } catch (const base::Error& e) {
      t.variant.failure = base::to_line(e.complaint());
      t.variant.label = label_of_what_fails(t);
      return e.complaint();
    }
  }

  /// As of the others where its keys make sense and only what they make does not.
  std::string label_of_what_fails(const Trial& t) const {
    try {
      return label_of(read_shot_alone(file_, run_of(t, {}).overrides).scene.options, t.variant.keys);
    } catch (const base::Error&) {
      std::string label;
      for (const auto& [key, value] : t.variant.keys) label += (label.empty() ? "" : " ") + value;
      return label;
    }
  }

  void plan_variants() {
    const bool own_cells = std::any_of(order_.vary.begin(), order_.vary.end(), [](const Varied& v) { return v.key == "sim.cell"; });
    const Coarser coarser = own_cells ? Coarser{{{}}, "cells as varied"} : coarser_cells(shot_);
    study_.notes.push_back(coarser.told);
    const std::vector<Sets> ladder = order_.vary.empty() ? scheme_ladder(shot_.scene.options.is_solid()) : combinations(order_.vary);
    std::vector<std::optional<base::Complaint>> complaints;
    for (const auto& size : coarser.sets)
      for (const Sets& sets : ladder) {
        Trial& t = variants_.emplace_back();
        t.variant.keys = sets;
        if (!own_cells) t.variant.keys.emplace_back("sim.cell", size.front().substr(size.front().find('=') + 1));
        t.sets = size;
        for (std::string& set : set_texts(sets)) t.sets.push_back(std::move(set));
        complaints.push_back(prepare(t));
      }
    refuse_what_suits_none(order_.vary, variants_, complaints);
    refuse_what_changes_nothing(order_.vary, variants_, "a simulation");
  }

  /// Where every variant sets what a quality sets, the reference alone may still be another.
  void refuse_idle_quality() const {
    if (!order_.overrides.quality) return;
    const auto text = [&](ShotRun run, bool with_quality) {
      if (!with_quality) run.overrides.quality.reset();
      return stage_text(read_shot(file_, run.overrides), "simulate");
    };
    for (const auto* trials : {&references_, &variants_})
      for (const Trial& t : *trials)
        if (!t.variant.ran() || text(run_of(t, {}), true) != text(run_of(t, {}), false)) return;
    throw base::Error({.file = "--quality " + *order_.overrides.quality, .message = kIdleQuality});
  }

  /// A step goes over all cells; that there are fewer steps on coarse ones is made up for by what a frame costs without any. Reflection projects
  /// twice, and asks for shorter steps. [dam breaks: within a third]
  double size_of(const Trial& t) const {
    const double work = t.variant.splitting == "reflection" ? 3 : 1;
    return work * std::pow(t.variant.cell, -double(shot_.scene.options.dimension));
  }

  /// As `polypic plan` foretells the reference.
  void tell_predicted_time(TrialRuns& runs) {
    const Stopwatch watch;
    std::optional<Pilot> pilot = cached_pilot(shot_, last_, order_.threads);
    if (!pilot) {
      progress_.line("       measuring small runs of the shot on this machine, a minute at most; they are kept ...");
      pilot = measure_pilot("/proc/self/exe", shot_, order_.overrides, last_, order_.threads);
      if (pilot) keep_pilot(shot_, order_.threads, *pilot);
    }
    if (!pilot) {
      progress_.line("runs   how long they take is not known: " + why_no_pilot(watch.seconds()));
      return;
    }
    const double simulating = predict(shot_, *pilot, {1, last_}).cpu["simulate"] / order_.threads;
    read_kept_runs(references_, runs);
    runs.known = KnownRun{simulating, kStart, size_of(references_.front())};
    runs.besides = seconds_besides(missing_pictures(variants_) + missing_pictures(references_), predicted_picture(pilot));
    const auto missing = std::count_if(references_.begin(), references_.end(), [](const Trial& t) { return t.kept.runs.empty(); });
    if (missing > 0) runs.besides.insert(runs.besides.begin(), {"the shot as it is", double(missing) * (simulating + kStart)});
    tell_time(variants_, runs, progress_);
  }

  /// [s] of a surface and its picture as a study draws them; 0 where no pilot says.
  double predicted_picture(const std::optional<Pilot>& pilot) const {
    if (!pilot) return 0;
    const Shot drawn = read_shot(file_, run_of(references_.front(), {}).overrides);
    double seconds = 0;
    for (const std::int64_t frame : pictures_)
      for (const auto& [stage, spent] : predict(drawn, *pilot, {frame, frame}).cpu)
        if (stage != stage_name(Stage::simulate)) seconds += spent / order_.threads / double(pictures_.size());
    return seconds;
  }

  /// Of the trials that can run.
  std::int64_t missing_pictures(const std::vector<Trial>& trials) const {
    std::int64_t missing = 0;
    for (const Trial& t : trials)
      if (shot_.has_pictures && t.variant.ran()) missing += std::int64_t(app::missing_pictures(run_of(t, folder_of(t)), pictures_).size());
    return missing;
  }

  /// What drawing and comparing take. Pictures of all variants have one size, and are taken to cost what the reference's do.
  std::vector<std::pair<std::string, double>> seconds_besides(std::int64_t pictures, double a_picture) const {
    std::vector<std::pair<std::string, double>> besides;
    if (pictures > 0) besides.emplace_back(base::count_of(pictures, "picture"), double(pictures) * a_picture);
    double particles = 0;
    for (const auto* trials : {&references_, &variants_})
      for (const Trial& t : *trials)
        if (t.variant.ran()) particles += sim::particles_at(double(last_ - 1) / shot_.fps, read_shot(file_, run_of(t, {}).overrides).scene);
    const double own = shot_.scene.options.dimension == 2 ? kComparedFlat : kCompared;
    besides.emplace_back("comparing", particles * double(compared_.size()) * own / order_.threads);
    return besides;
  }

  /// The shot as it is, and once more with particles seeded otherwise.
  void plan_references() {
    references_.resize(2);
    references_[0].variant.label = "reference";
    references_[1].variant.label = "reference, another seed";
    const sim::Options& o = shot_.scene.options;
    if (o.seeding == sim::Seeding::regular) references_[1].sets.push_back("sim.seeding=jitter");
    references_[1].sets.push_back("sim.seed=" + std::to_string(o.seed + 1));
    for (Trial& t : references_)
      if (const auto complaint = prepare(t)) throw base::Error(*complaint);
  }

  TrialRuns runs_of(int repeats) {
    TrialRuns runs{.repeats = repeats, .folder = order_.out / "variants", .run = {}, .audit = {}, .size = {}, .known = {}, .besides = {}};
    runs.size = [&](const Trial& t) { return size_of(t); };
    runs.run = [&](const Trial& t, int repeat, std::string& failure) {
      if (repeat == 0) return simulate(run_of(t, folder_of(t)), failure);   // its frames are kept
      return scratch_run(t, {}, failure);
    };
    return runs;
  }

  void keep_sizes(std::vector<Trial>& trials) const {
    for (Trial& t : trials)
      if (t.variant.ran()) t.variant.disk_bytes = simulated_bytes(folder_of(t));
  }

  /// Points and checkpoints: what a simulation leaves.
  static std::int64_t simulated_bytes(const fs::path& folder) {
    std::error_code none;
    std::int64_t bytes = 0;
    for (const char* part : {"points", "checkpoint"})
      if (fs::is_directory(folder / part, none)) bytes += disk_bytes(folder / part);
    return bytes;
  }

  MeasuredRun scratch_run(const Trial& t, const std::vector<std::string>& sets, std::string& failure) {
    const fs::path out = order_.out / ".scratch";
    std::error_code none;
    fs::remove_all(out, none);
    ShotRun run = run_of(t, out);
    run.overrides.sets.insert(run.overrides.sets.end(), sets.begin(), sets.end());
    const MeasuredRun found = simulate(run, failure);
    fs::remove_all(out, none);
    return found;
  }

  MeasuredRun audited(const Trial& t, std::string& failure) { return scratch_run(t, {"sim.audit=true"}, failure); }

  std::vector<Trial*> all() {
    std::vector<Trial*> list;
    for (auto* trials : {&references_, &variants_})
      for (Trial& t : *trials)
        if (t.variant.ran()) list.push_back(&t);
    return list;
  }

  /// How many were missing.
  std::int64_t make_pictures(std::vector<Trial>& trials) {
    const std::int64_t missing = missing_pictures(trials);
    for (Trial& t : trials) {
      if (!shot_.has_pictures || !t.variant.ran()) continue;
      const ShotRun run = run_of(t, folder_of(t));
      t.variant.failure = app::make_pictures(run, pictures_);
      if (!t.variant.ran()) continue;
      for (const std::int64_t frame : pictures_) t.variant.pictures.push_back({frame, Folder(run.out).image(frame, ".png")});
      progress_.line("drawn  " + t.variant.label);
    }
    return missing;
  }

  bool has_surface() const { return shot_.scene.options.dimension == 3; }

  /// Distances of a trial from the reference, by frame.
  struct Distances {
    std::array<std::vector<double>, kMeasureNames.size()> by_measure;   // beside the frames below
    std::array<std::vector<std::int64_t>, kMeasureNames.size()> frames;
    void add(Measure m, std::int64_t frame, std::optional<double> d) {
      if (d) by_measure[std::size_t(m)].push_back(*d), frames[std::size_t(m)].push_back(frame);
    }
    /// Mean up to a frame; empty where nothing was compared.
    std::optional<double> mean_until(Measure m, std::int64_t horizon) const {
      std::vector<double> values;
      for (std::size_t i = 0; i < frames[std::size_t(m)].size(); ++i)
        if (frames[std::size_t(m)][i] <= horizon) values.push_back(by_measure[std::size_t(m)][i]);
      if (values.empty()) return {};
      return mean(values);
    }
  };

  /// Cells of the coarsest variant: what every variant can know of a flow.
  double coarsest_cell() const {
    double cell = shot_.scene.options.cell;
    for (const Trial& t : variants_)
      if (t.variant.ran()) cell = std::max(cell, t.variant.cell);
    return cell;
  }

  void compare_points(const std::vector<Trial*>& trials, std::vector<Distances>& found) {
    const double coarse = coarsest_cell();
    const std::int64_t dimension = shot_.scene.options.dimension;
    for (const std::int64_t frame : compared_) {
      std::optional<Projections> truth;
      std::optional<VorticityGrid> swirl;
      for (std::size_t i = 0; i < trials.size(); ++i) {
        const sim::Frame points = surface::read_points(Folder(folder_of(*trials[i])).points(frame));
        sim::Options seeded = shot_.scene.options;
        seeded.cell = trials[i]->variant.cell;
        seeded.particles_per_cell = read_shot(file_, run_of(*trials[i], {}).overrides).scene.options.particles_per_cell;
        Projections lines(points, dimension);
        VorticityGrid grid(points, seeded, coarse);
        if (i == 0) {
          truth.emplace(std::move(lines)), swirl.emplace(std::move(grid));
          continue;
        }
        found[i].add(Measure::position, frame, truth->distance(lines) / shot_.scene.options.cell);
        found[i].add(Measure::vorticity, frame, swirl->distance(grid));
      }
    }
  }

  void compare_pictures(const std::vector<Trial*>& trials, std::vector<Distances>& found) {
    if (!shot_.has_pictures) return;
    const double reach = 3 * shot_.surface.voxel.value_or(shot_.scene.options.cell / 2) * coarsest_cell() / shot_.scene.options.cell;
    for (const std::int64_t frame : pictures_) {
      std::optional<surface::Mesh> truth;
      std::optional<render::Image> picture;
      base::Ledger unused;
      for (std::size_t i = 0; i < trials.size(); ++i) {
        const Folder folder(folder_of(*trials[i]));
        render::Image image = render::read_image(folder.image(frame, ".png"));
        std::optional<surface::Mesh> mesh;
        if (has_surface()) mesh = surface::read_surface(folder.surface(frame), shot_.surface, unused);
        if (i == 0) {
          truth = std::move(mesh), picture = std::move(image);
          continue;
        }
        found[i].add(Measure::image, frame, render::compare(*picture, image, 0).values.mean());
        if (mesh) {
          const std::optional<double> away = surface_distance(*truth, *mesh, reach);
          found[i].add(Measure::surface, frame, away ? std::optional(*away / shot_.scene.options.cell) : away);
        }
      }
    }
  }

  /// Energy, and every error by frame; what is not above the noise is left out.
  void compare() {
    std::vector<Trial*> trials = all();
    std::vector<Distances> found(trials.size());
    compare_points(trials, found);
    compare_pictures(trials, found);
    const std::vector<double>& truth = trials[0]->variant.course.energy;
    std::vector<double> energy(trials.size(), 0);
    for (std::size_t i = 1; i < trials.size(); ++i) {
      std::vector<double> away;
      const std::vector<double>& own = trials[i]->variant.course.energy;
      for (std::size_t f = 0; f < std::min(own.size(), truth.size()); ++f) away.push_back(std::abs(own[f] - truth[f]));
      energy[i] = mean(away);
    }
    const std::int64_t horizon = horizon_of(trials, found);
    Errors& noise = study_.cases.front().noise;
    noise[Measure::energy] = energy[1];
    for (const Measure m : kByFrame) noise[m] = found[1].mean_until(m, horizon);
    for (std::size_t i = 2; i < trials.size(); ++i) {
      Errors& errors = trials[i]->variant.errors;
      const auto put = [&](Measure m, std::optional<double> e) {
        if (e && *e > noise[m].value_or(0)) errors[m] = e;
      };
      put(Measure::energy, energy[i]);
      for (const Measure m : kByFrame) put(m, found[i].mean_until(m, horizon));
    }
    references_.front().variant.errors = {};
    explain(horizon);
  }

  /// The last frame that is compared with the reference's: up to it the reference's own chance moves particles less than half as far as variants are
  /// away.
  std::int64_t horizon_of(const std::vector<Trial*>& trials, const std::vector<Distances>& found) const {
    const auto at = std::size_t(Measure::position);
    std::int64_t horizon = 0;
    for (std::size_t f = 0; f < compared_.size(); ++f) {
      std::vector<double> errors;
      for (std::size_t i = 2; i < found.size(); ++i)
        if (!is_reference(*trials[i])) errors.push_back(found[i].by_measure[at][f]);
      if (errors.empty() || found[1].by_measure[at][f] > kTrusted * median(errors)) break;
      horizon = compared_[f];
    }
    return horizon;
  }

  /// A variant may be the shot as it is: it has no error, and says nothing of how far variants are away.
  bool is_reference(const Trial& t) const { return t.hash == references_.front().hash; }

  void explain(std::int64_t horizon) {
    for (const Trial& t : variants_)
      if (is_reference(t)) study_.notes.push_back(t.variant.label + " is the shot as it is, and so without error");
    const std::string own = base::to_text(shot_.scene.options.cell);
    study_.meaning[std::size_t(Measure::energy)] = "of kinetic, potential and elastic energy over that of the first frame, mean over all frames";
    study_.meaning[std::size_t(Measure::position)] = "sliced Wasserstein distance of the particles, in cells of " + own + " m";
    study_.meaning[std::size_t(Measure::vorticity)] =
        "root of squares over that of the reference, on cells of " + fmt::format("{:.3g} m", coarsest_cell());
    study_.meaning[std::size_t(Measure::volume)] =
        "mean part by which the liquid's surface holds more or less than its particles are worth, over all frames";
    if (has_surface() && shot_.has_pictures)
      study_.meaning[std::size_t(Measure::surface)] = "mean distance of the two surfaces, in cells of " + own + " m";
    if (shot_.has_pictures) study_.meaning[std::size_t(Measure::image)] = "mean difference of the pictures, 480 x 270, 0 to 1";
    study_.notes.push_back(
        horizon == last_ ? fmt::format("frames are compared one by one up to the last, {}", last_)
        : horizon > 0 || std::all_of(variants_.begin(), variants_.end(), [&](const Trial& t) { return is_reference(t); })
            ? fmt::format("frames are compared one by one up to {}; later ones differ by chance, and count in energy and volume alone", horizon)
            : "two runs of the reference with different seeds lie as far apart as the variants: frames cannot be compared one by one");
  }

  fs::path file_;
  const CostOrder& order_;
  base::Progress& progress_;
  Shot shot_;
  std::int64_t last_;
  std::vector<std::string> more_;             // sets of the picture
  std::vector<std::int64_t> compared_, pictures_;
  std::vector<Trial> references_, variants_;
  Study study_;
};

}  // namespace

Study study_of_shot(const fs::path& shot, const CostOrder& order, base::Progress& progress) { return ShotStudy(shot, order, progress).make(); }

}  // namespace app
