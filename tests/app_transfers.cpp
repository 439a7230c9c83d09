// Every transfer makes a film: one small liquid with each scheme, kernel and dimension, and what cannot be combined.
#include <cmath>
#include <map>

#include "film_test.h"

namespace {

class Transfers : public FilmTest {
 protected:
  /// A column that leans on a wall: 4320 particles in space, 1440 in the plane. Two frames a twelfth of a second apart: some sub-steps.
  static std::string shot(int dimension, const std::string& transfer) {
    const std::string space = "domain = [[0, 0, 0], [0.6, 0.3, 0.3]]\ncell = 0.03\n",
                      plane = "dimension = 2\ndomain = [[0, 0], [0.6, 0.3]]\ncell = 0.01\n";
    const std::string box = dimension == 3 ? "[[0, 0, 0], [0.27, 0.3, 0.18]]" : "[[0, 0], [0.2, 0.18]]";
    return "[shot]\nframes = 2\nfps = 12\n[sim]\n" + (dimension == 3 ? space : plane) + transfer +
           "\n[[body]]\nname = \"column\"\nshape = { box = " + box + " }\n[[effect]]\nkind = \"gravity\"\n[render]\nwidth = 160\nheight = 90\n" +
           (dimension == 3 ? "spp = 1\n" : "");
  }
  /// Makes one film and returns what the ledger says of its last frame.
  Json film(int dimension, const std::string& transfer, const std::string& out) const {
    write("x.toml", shot(dimension, transfer));
    run_well({"run", "x.toml", "--quiet", "--out", out});
    const Json run = run_json(out);
    EXPECT_EQ(run.at("frames").size(), 2u);
    for (const char* name : {"movie.mp4", "images/beauty.0002.png", "points/points.0002.vdb"})
      EXPECT_TRUE(std::filesystem::exists(folder / out / name)) << name;
    const Json start = run.at("frames").at(0), end = Json::parse(text_of(folder / out / "ledger/simulate.0002.json"));
    const auto energy = [](const Json& f) { return f.at("kinetic_energy").get<double>() + f.at("potential_energy").get<double>(); };
    EXPECT_GE(end.at("substeps"), 2);
    EXPECT_EQ(end.at("particles"), start.at("particles"));
    EXPECT_GT(end.at("kinetic_energy"), 0.01 * energy(start));
    EXPECT_LE(energy(end), 1.005 * energy(start));
    return end;
  }
};

struct Scheme {
  std::string keys;
  int modes;          // of a component in the plane and in space
  int modes_in_space;
};

const std::vector<Scheme> kLinear = {{"transfer = \"pic\"", -1, -1},
                                     {"transfer = \"flip\"", -2, -2},
                                     {"transfer = \"apic\"", 3, 4},
                                     {"transfer = \"polypic\"\nmodes = 2", 2, 2},
                                     {"transfer = \"polypic\"\nmodes = \"multilinear\"", 4, 8},
                                     {"transfer = \"polypic\"\nmodes = \"full\"", 4, 8},
                                     {"transfer = \"polypic\"", 4, 8}};
const std::vector<Scheme> kQuadratic = {{"transfer = \"pic\"", -1, -1},
                                        {"transfer = \"flip\"", -2, -2},
                                        {"transfer = \"apic\"", 3, 4},
                                        {"transfer = \"polypic\"\nmodes = 5", 5, 5},
                                        {"transfer = \"polypic\"\nmodes = 8", 8, 8},
                                        {"transfer = \"polypic\"\nmodes = \"multilinear\"", 4, 8},
                                        {"transfer = \"polypic\"\nmodes = \"quadratic\"", 6, 10},
                                        {"transfer = \"polypic\"\nmodes = \"full\"", 9, 27},
                                        {"transfer = \"polypic\"\nmodes = \"full\"\ncarry = \"limited\"", -3, -3},
                                        {"transfer = \"polypic\"\nmodes = \"full\"\ncarry = \"hybrid\"", -4, -4},
                                        {"transfer = \"polypic\"\nmodes = \"full\"\nprecision = \"double\"", -5, -5}};

}  // namespace

// Two films are the same if and only if they carry the same modes the same way.
TEST_F(Transfers, OfEverySchemeKernelAndDimensionMakeAFilm) {
  std::map<std::string, std::string> scheme_of;   // by state at the end
  int films = 0;
  for (const int dimension : {2, 3})
    for (const bool linear : {true, false})
      for (const Scheme& scheme : linear ? kLinear : kQuadratic) {
        const std::string keys = scheme.keys + (linear ? "\nkernel = \"linear\"" : "\nkernel = \"quadratic\"");
        SCOPED_TRACE(testing::Message() << dimension << "-D, " << keys);
        const Json end = film(dimension, keys, "out/" + std::to_string(++films));
        const bool limits = keys.find("limited") != keys.npos || keys.find("hybrid") != keys.npos;
        EXPECT_EQ(end.at("limited_modes").get<std::int64_t>() > 0, limits);
        EXPECT_GE(end.at("light_faces"), 0);
        const int modes = dimension == 2 ? scheme.modes : scheme.modes_in_space;
        const std::string carried = std::to_string(dimension) + (linear ? " linear " : " quadratic ") + std::to_string(modes);
        EXPECT_EQ(scheme_of.try_emplace(end.at("state_hash"), carried).first->second, carried);
      }
  EXPECT_EQ(films, 36);
  EXPECT_EQ(scheme_of.size(), 31u);   // the named sets and the default are counts by another name
}

TEST_F(Transfers, ThatCannotBeCombinedAreRefusedWithOneLine) {
  const std::vector<std::pair<std::string, std::string>> refused = {
      {"transfer = \"mpm\"", "sim.transfer = \"mpm\": must be"},
      {"kernel = \"cubic\"", "sim.kernel = \"cubic\": must be"},
      {"transfer = \"pic\"\nmodes = 1", "sim.modes = 1: needs sim.transfer = \"polypic\""},
      {"transfer = \"apic\"\nmodes = \"full\"", "sim.modes = \"full\": needs sim.transfer = \"polypic\""},
      {"transfer = \"flip\"\nmodes = 4", "sim.modes = 4: needs sim.transfer = \"polypic\""},
      {"transfer = \"apic\"\nflip_time = 1", "sim.flip_time = 1 s: needs sim.transfer = \"flip\""},
      {"kernel = \"linear\"\nmodes = \"quadratic\"", "needs sim.kernel = \"quadratic\""},
      {"kernel = \"linear\"\nmodes = 9", "must be a count from 1 to"},
      {"kernel = \"quadratic\"\nmodes = 28", "must be a count from 1 to"},
      {"kernel = \"quadratic\"\nmodes = 0", "must be a count from 1"},
      {"kernel = \"linear\"\ncarry = \"limited\"", "needs sim.kernel = \"quadratic\""},
      {"kernel = \"linear\"\ncarry = \"hybrid\"", "needs sim.kernel = \"quadratic\""},
      {"transfer = \"apic\"\nkernel = \"quadratic\"\ncarry = \"hybrid\"", "sim.carry = \"hybrid\": needs sim.transfer = \"polypic\""},
      {"kernel = \"quadratic\"\nmodes = 4\ncarry = \"limited\"", "sim.carry = \"limited\": needs more sim.modes"},
      {"kernel = \"quadratic\"\nmodes = \"multilinear\"\ncarry = \"hybrid\"", "sim.carry = \"hybrid\": needs more sim.modes"},
      {"kernel = \"quadratic\"\ncarry = \"reexpanded\"", "sim.carry = \"reexpanded\": must be"}};
  for (const int dimension : {2, 3})
    for (const auto& [keys, reason] : refused) {
      write("x.toml", shot(dimension, keys));
      const auto before = files();
      const Outcome outcome = run({"run", "x.toml"});
      EXPECT_EQ(outcome.exit, 2) << keys;
      EXPECT_EQ(outcome.complaints(), 1) << outcome.err;
      EXPECT_TRUE(outcome.err.starts_with("polypic: x.toml:")) << outcome.err;
      EXPECT_NE(outcome.err.find(reason), std::string::npos) << outcome.err;
      EXPECT_EQ(files(), before);
    }
}
