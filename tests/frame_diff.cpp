// Small films held against goldens: physical sums and pictures with tolerances, in tests/frame_diff/*.json. Every golden has mutants,
// the same film with one parameter changed, which must not pass for it. docs/diff.md says how goldens are renewed.
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "render/render.h"
#include "run_program.h"
#include "tests/surface_bodies.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

const fs::path kCases = fs::path(POLYPIC_SOURCE_DIR) / "tests/frame_diff";

std::vector<std::string> case_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kCases))
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

Json read_case(const std::string& name) {
  std::ifstream in(kCases / (name + ".json"));
  return Json::parse(in);
}

/// A film that was made: what is measured of each frame, and the last picture where the case has one.
struct Made {
  std::map<std::string, std::vector<Json>> values;   // by quantity, a number or a vector a frame
  fs::path picture;
};

double length(const Json& value) {
  if (value.is_number()) return std::abs(value.get<double>());
  double squares = 0;
  for (const Json& part : value) squares += part.get<double>() * part.get<double>();
  return std::sqrt(squares);
}

double distance(const Json& a, const Json& b) {
  if (a.is_number()) return std::abs(a.get<double>() - b.get<double>());
  Json difference = Json::array();
  for (std::size_t i = 0; i < a.size(); ++i) difference.push_back(a[i].get<double>() - b.at(i).get<double>());
  return length(difference);
}

/// The largest difference of any frame over the largest value of any frame: a sum may start at zero. Infinite where frames are missing.
double relative_difference(const std::vector<Json>& golden, const std::vector<Json>& actual) {
  double scale = 0, largest = 0;
  if (golden.empty() || golden.size() != actual.size()) return INFINITY;
  for (std::size_t i = 0; i < golden.size(); ++i) {
    scale = std::max(scale, length(golden[i]));
    largest = std::max(largest, distance(golden[i], actual[i]));
  }
  return largest > 0 ? largest / scale : 0;
}

class FrameDiff : public ProgramTest, public testing::WithParamInterface<std::string> {
 protected:
  const Json film = read_case(GetParam());

  fs::path golden_picture() const { return kCases / (GetParam() + ".png"); }
  static fs::path kept(const std::string& name) { return fs::path(POLYPIC_KEPT) / name; }

  /// Makes the film with these keys on top of the case's, in a new folder of the build tree.
  Made make(const std::string& name, const std::vector<std::string>& keys) const {
    const fs::path out = kept(name);
    fs::remove_all(out);
    std::vector<std::string> options = {(fs::path(POLYPIC_SOURCE_DIR) / film.at("shot").get<std::string>()).string(), "--out", out.string(),
                                        "--frames", "1-" + film.at("frames").dump(), "--json", "--quiet"};
    for (const auto& list : {film.at("set").get<std::vector<std::string>>(), keys})
      for (const std::string& key : list) options.insert(options.end(), {"--set", key});
    Json run_document;
    std::vector<std::string> stages = {"run"};
    if (!film.contains("image"))
      stages = film.at("sums").contains("surface_area") ? std::vector<std::string>{"simulate", "surface"} : std::vector<std::string>{"simulate"};
    for (const std::string& stage : stages) {
      std::vector<std::string> words = {stage};
      words.insert(words.end(), options.begin(), options.end());
      const Outcome outcome = run(words);
      EXPECT_EQ(outcome.exit, 0) << outcome.err;
      if (outcome.exit != 0) return {};
      run_document = Json::parse(outcome.out);
    }
    return measured(run_document, out);
  }

  Made measured(const Json& document, const fs::path& out) const {
    Made made;
    for (const Json& frame : document.at("frames")) {
      for (const auto& [name, row] : film.at("sums").items())
        if (frame.contains(name)) made.values[name].push_back(frame[name]);
      char number[16];
      std::snprintf(number, sizeof number, "%04d", frame.at("frame").get<int>());
      made.picture = out / "images" / (std::string("beauty.") + number + ".png");
      if (!film.at("sums").contains("surface_area")) continue;
      base::Ledger untold;
      const surface::Mesh mesh = surface::read_surface(out / "surface" / (std::string("surface.") + number + ".vdb"), {}, untold);
      double area = 0;
      for (const auto& quad : mesh.quads) area += surface_test::vector_area(mesh, quad).norm();
      made.values["surface_area"].push_back(area);
      made.values["surface_volume"].push_back(surface_test::volume(mesh));
    }
    return made;
  }

  render::ImageDifference compare_pictures(const Made& made) const {
    return render::compare(render::read_image(golden_picture()), render::read_image(made.picture), film.at("image").at("over").get<double>());
  }

  /// Why the film is not the golden one, each line starting with the name of the quantity; none when it is.
  std::vector<std::string> objections(const Made& made) const {
    std::vector<std::string> lines;
    for (const auto& [name, row] : film.at("sums").items()) {
      const auto actual = made.values.find(name);
      const double difference =
          actual == made.values.end() ? INFINITY : relative_difference(row.at("values").get<std::vector<Json>>(), actual->second);
      const double allowed = row.at("tolerance");
      if (!(difference <= allowed))
        lines.push_back(name + " differs by " + Json(difference).dump() + " of its largest value, allowed is " + Json(allowed).dump());
    }
    if (!film.contains("image")) return lines;
    const render::ImageDifference difference = compare_pictures(made);
    const Json& image = film["image"];
    if (difference.values.mean() > image.at("mean").get<double>())
      lines.push_back("image: the mean difference is " + Json(difference.values.mean()).dump() + ", allowed is " + image["mean"].dump());
    if (difference.percent_over() > image.at("percent_over").get<double>())
      lines.push_back("image: " + Json(difference.percent_over()).dump() + " % of the pixels differ by more than " + image["over"].dump() +
                      ", allowed are " + image["percent_over"].dump() + " %");
    return lines;
  }

  /// Puts golden and difference beside the film, for people to look at.
  std::string keep(const Made& made, const std::string& name) const {
    if (film.contains("image") && fs::exists(made.picture)) {
      const render::Image golden = render::read_image(golden_picture()), actual = render::read_image(made.picture);
      fs::copy_file(golden_picture(), kept(name) / "golden.png", fs::copy_options::overwrite_existing);
      fs::copy_file(made.picture, kept(name) / "actual.png", fs::copy_options::overwrite_existing);
      base::Ledger untold;
      render::write_png(kept(name) / "difference.png", render::difference_picture(golden, actual, render::compare(golden, actual, 0)).image, {}, true,
                        untold);
    }
    return "kept in " + kept(name).string();
  }

  void renew() const;
};

/// Two digits tell the size of what is measured only to choose a tolerance.
double rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", value);
  return std::strtod(text, nullptr);
}

/// Half-way, in powers of ten, between what round-off does and what another seed does; sums that neither changes keep to round-off of a sum.
double tolerance_between(double round_off, double other_seed) {
  constexpr double kSum = 1e-9;
  return std::pow(10, std::round(std::log10(std::sqrt(std::max(round_off, kSum) * std::max(other_seed, kSum)))));
}

// New values and pictures, and how far round-off and another seed go from them. Tolerances that are there stay.
void FrameDiff::renew() const {
  Json renewed = film;
  const Made made = make(GetParam(), {}), rounding = make(GetParam() + ".round_off", film.at("round_off")),
             seed = make(GetParam() + ".seed", film.at("other_seed"));
  for (auto& [name, row] : renewed["sums"].items()) {
    const double by_rounding = relative_difference(made.values.at(name), rounding.values.at(name)),
                 by_seed = relative_difference(made.values.at(name), seed.values.at(name));
    row = {{"tolerance", row.value("tolerance", tolerance_between(by_rounding, by_seed))}, {"round_off", rounded(by_rounding)},
           {"other_seed", rounded(by_seed)}, {"values", made.values.at(name)}};
  }
  if (film.contains("image")) {
    fs::copy_file(made.picture, golden_picture(), fs::copy_options::overwrite_existing);
    for (const auto& [name, other] : {std::pair{"round_off", &rounding}, {"other_seed", &seed}}) {
      const render::ImageDifference difference = compare_pictures(*other);
      renewed["image"][name] = {{"mean", rounded(difference.values.mean())}, {"percent_over", rounded(difference.percent_over())}};
    }
  }
  std::ofstream(kCases / (GetParam() + ".json")) << renewed.dump(2) << "\n";
  for (const char* end : {"", ".round_off", ".seed"}) fs::remove_all(kept(GetParam() + end));
}

}  // namespace

TEST(FrameDiffCases, AreThere) {
  const std::vector<std::string> names = case_names();
  EXPECT_GE(names.size(), 5u);
  for (const std::string& name : names) {
    const Json film = read_case(name);
    EXPECT_GE(film.at("frames"), 2) << name;
    EXPECT_FALSE(film.at("mutants").empty()) << name;
    EXPECT_TRUE(film.at("sums").contains("kinetic_energy")) << name;
  }
}

// A tolerance below round-off would fail on another processor; one above a seed's difference would see nothing.
TEST(FrameDiffCases, HaveTolerancesBetweenRoundOffAndAnotherSeed) {
  for (const std::string& name : case_names()) {
    const Json film = read_case(name);
    for (const auto& [quantity, row] : film.at("sums").items()) {
      const double tolerance = row.at("tolerance"), seed = row.at("other_seed");
      EXPECT_GE(tolerance, 3 * row.at("round_off").get<double>()) << name << " " << quantity;
      EXPECT_LE(tolerance, std::max(seed, 1e-9)) << name << " " << quantity;
    }
    if (!film.contains("image")) continue;
    for (const char* measure : {"mean", "percent_over"}) {
      const double tolerance = film["image"].at(measure);
      EXPECT_GE(tolerance, 3 * film["image"].at("round_off").at(measure).get<double>()) << name << " image " << measure;
      EXPECT_LE(tolerance, film["image"].at("other_seed").at(measure).get<double>()) << name << " image " << measure;
    }
  }
}

TEST_P(FrameDiff, HoldsItsGolden) {
  surface::initialize();
  if (std::getenv("POLYPIC_RENEW_GOLDENS") != nullptr) return renew();
  const Made made = make(GetParam(), {});
  if (HasFailure()) return;
  const std::vector<std::string> lines = objections(made);
  for (const std::string& line : lines) ADD_FAILURE() << line;
  if (lines.empty()) fs::remove_all(kept(GetParam()));
  else ADD_FAILURE() << keep(made, GetParam());
}

TEST_P(FrameDiff, RefusesEveryMutant) {
  surface::initialize();
  if (std::getenv("POLYPIC_RENEW_GOLDENS") != nullptr) return;
  for (const Json& mutant : film.at("mutants")) {
    const std::string keys = mutant.at("set").dump(), seen_in = mutant.at("seen_in");
    const Made made = make(GetParam() + ".mutant", mutant["set"]);
    if (HasFailure()) return;
    const std::vector<std::string> lines = objections(made);
    const bool seen = std::any_of(lines.begin(), lines.end(), [&](const std::string& line) { return line.starts_with(seen_in); });
    EXPECT_TRUE(seen) << keys << " passes for the golden " << seen_in << "; " << keep(made, GetParam() + ".mutant");
    if (!seen) return;
    std::printf("%s: %s\n", keys.c_str(),
                std::find_if(lines.begin(), lines.end(), [&](const std::string& line) { return line.starts_with(seen_in); })->c_str());
    fs::remove_all(kept(GetParam() + ".mutant"));
  }
}

INSTANTIATE_TEST_SUITE_P(Films, FrameDiff, testing::ValuesIn(case_names()), [](const auto& film) { return film.param; });
