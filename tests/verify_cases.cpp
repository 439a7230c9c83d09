// The hard cases of the simulation by themselves: each says what it expects, names are there once, and chosen ones run. POLYPIC_CASES names others.
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <sstream>

#include "sim/verify.h"

namespace sim {
namespace {

TEST(VerifyCases, SayWhatTheyExpectAndHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  const std::vector<VerifyCase> all = verify_cases();
  EXPECT_GE(all.size(), 60u);
  for (const VerifyCase& c : all) {
    EXPECT_TRUE(names.insert(c.name).second) << c.name;
    EXPECT_FALSE(c.expect.empty() || c.source.empty() || c.transfer.empty() || c.kernel.empty() || c.integrator.empty()) << c.name;
    EXPECT_TRUE(c.dimension == 2 || c.dimension == 3) << c.name;
  }
  const auto is_built = [&](const std::string& name) { return std::any_of(names.begin(), names.end(), [&](const std::string& n) { return n.starts_with(name); }); };
  for (const CaseNotBuilt& c : cases_not_built()) EXPECT_FALSE(is_built(c.name)) << c.name;
  for (const CaseNotBuilt& c : cases_not_built()) EXPECT_TRUE(names.insert(c.name).second && !c.needs.empty() && !c.source.empty()) << c.name;
}

// Every pair of a transfer with a kernel, precision and splitting is there, over both dimensions.
TEST(VerifyCases, CoverThePairsOfWhatAFluidCanBe) {
  std::set<std::pair<std::string, std::string>> pairs;
  for (const VerifyCase& c : verify_cases()) {
    if (!c.name.starts_with("dam_break/")) continue;
    const bool is_single = c.name.ends_with("single"), all = c.transfer == (c.kernel == "linear" ? (c.dimension == 2 ? "polypic4" : "polypic8")
                                                                            : (c.dimension == 2 ? "polypic9" : "polypic27"));
    for (const std::string& transfer : {c.transfer, all ? std::string("full") : c.transfer})
      for (const std::string& other : {c.kernel, c.integrator, std::string(is_single ? "single" : "double"),
                                       std::to_string(c.dimension)}) pairs.insert({transfer, other});
  }
  for (const char* transfer : {"pic", "flip", "apic", "full"})
    for (const char* other : {"linear", "quadratic", "lie", "reflection", "single", "double", "2",
                              "3"}) EXPECT_TRUE(pairs.contains({transfer, other})) << transfer << " " << other;
}

TEST(VerifyCases, ThatAreChosenPass) {
  const char* const given = std::getenv("POLYPIC_CASES");
  std::istringstream words(given ? given : "round_trip return_mapping coincident step_collapses thin_wall");
  int ran = 0;
  for (std::string word; words >> word;)
    for (const VerifyCase& c : verify_cases()) {
      if (!c.name.starts_with(word) || !c.is_quick) continue;
      const CaseOutcome found = c.run();
      ++ran;
      std::printf("%s %s  %s\n", passes(c, found) ? "ok  " : "FAIL", c.name.c_str(), found.outcome.c_str());
      EXPECT_TRUE(passes(c, found)) << c.name << ": " << found.outcome << (found.broken.empty() ? "" : "; " + found.broken.front());
    }
  EXPECT_GT(ran, 0);
}

}  // namespace
}  // namespace sim
