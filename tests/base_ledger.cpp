// The ledger adds up what passes cost, and knows nothing of one that did not run.
#include "base/ledger.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "base/error.h"

TEST(Ledger, HasNoRowForAPassThatDidNotRun) {
  base::Ledger ledger;
  EXPECT_TRUE(ledger.passes().empty());
  { const auto timer = ledger.pass("sort"); }
  EXPECT_EQ(ledger.passes().size(), 1u);
  EXPECT_EQ(ledger.passes().count("p2g"), 0u);
}

TEST(Ledger, CountsCallsSecondsAndBytesOfAPass) {
  base::Ledger ledger;
  for (int i = 0; i < 3; ++i) {
    const auto timer = ledger.pass("p2g", 100);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const base::PassCost& cost = ledger.passes().at("p2g");
  EXPECT_EQ(cost.calls, 3);
  EXPECT_EQ(cost.bytes, 300);
  EXPECT_GE(cost.seconds, 0.015);
  EXPECT_LT(cost.seconds, 5);
}

TEST(Ledger, AddsTheCostsOfAnother) {
  base::Ledger ledger;
  ledger.add("trace", {2, 0.5, 10});
  ledger.add("trace", {1, 0.25, 1});
  EXPECT_EQ(ledger.passes().at("trace").calls, 3);
  EXPECT_EQ(ledger.passes().at("trace").seconds, 0.75);
  EXPECT_EQ(ledger.passes().at("trace").bytes, 11);
  ledger.clear();
  EXPECT_TRUE(ledger.passes().empty());
}

TEST(Ledger, CountsAPassThatThrows) {
  base::Ledger ledger;
  try {
    const auto timer = ledger.pass("pressure");
    throw 1;
  } catch (int) {
  }
  EXPECT_EQ(ledger.passes().at("pressure").calls, 1);
}

namespace {

base::Plan small_plan() {
  base::Plan plan;
  plan.stage = "simulate";
  plan.attributes = {{"cell", 12}};
  plan.passes = {{"sort", base::PassRow::Often::step, {}, {}}};
  return plan;
}

}  // namespace

TEST(Ledger, RefusesAPassThatIsNotInItsPlan) {
  base::Ledger ledger(small_plan());
  { const auto timer = ledger.pass("sort"); }
  bool ran = false;
  try {
    const auto timer = ledger.pass("pressure");
    ran = true;
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::fault);
    EXPECT_EQ(std::string(e.what()), "pass pressure is not in the plan of simulate");
  }
  EXPECT_FALSE(ran);
  EXPECT_EQ(ledger.passes().size(), 1u);
}

TEST(Ledger, RefusesAnAttributeThatIsNotInItsPlan) {
  base::Ledger ledger(small_plan());
  ledger.hold("cell", 1200);
  EXPECT_EQ(ledger.attributes().at("cell"), 1200);
  EXPECT_THROW(ledger.hold("F", 36), base::Error);
  EXPECT_EQ(ledger.attributes().size(), 1u);
}

TEST(Ledger, CountsBytesThatAreKnownAtTheEnd) {
  base::Ledger ledger;
  {
    auto timer = ledger.pass("pressure", 10);
    timer.count(32);
  }
  EXPECT_EQ(ledger.passes().at("pressure").bytes, 42);
}

TEST(Ledger, CountsTheWorkOfAllThreads) {
  base::Ledger ledger;
  {
    const auto timer = ledger.pass("p2g");
    const auto work = [] {
      const double end = base::process_seconds() + 0.02;
      while (base::process_seconds() < end) {}
    };
    std::thread other(work);
    work();
    other.join();
  }
  EXPECT_GE(ledger.passes().at("p2g").cpu_seconds, 0.02);
}
