// The ledger adds up what passes cost, and knows nothing of one that did not run.
#include "base/ledger.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

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
