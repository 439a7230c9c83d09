// Ranges, numbers and near words, as errors and tables show them.
#include "base/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/params.h"

TEST(Range, SaysWhatItAllows) {
  EXPECT_EQ(base::any().text(), "");
  EXPECT_EQ(base::above(0).text(), "above 0");
  EXPECT_EQ(base::at_least(1).text(), "at least 1");
  EXPECT_EQ(base::between(0, 0.5).text(), "between 0 and 0.5 (both excluded)");
  EXPECT_EQ(base::within(1, 1000000).text(), "between 1 and 1000000");
  EXPECT_EQ(base::within(3, 3).text(), "3");
  EXPECT_EQ((base::Range{.low = 0, .high = 2, .low_open = true}.text()), "above 0 and at most 2");
  EXPECT_EQ((base::Range{.high = 2, .high_open = true}.text()), "below 2");
}

TEST(Range, HoldsItsClosedEndsOnly) {
  EXPECT_FALSE(base::above(0).contains(0));
  EXPECT_TRUE(base::above(0).contains(std::nextafter(0.0, 1.0)));
  EXPECT_TRUE(base::at_least(0).contains(0));
  EXPECT_FALSE(base::between(0, 1).contains(1));
  EXPECT_TRUE(base::within(0, 1).contains(1));
  EXPECT_FALSE(base::within(0, 1).contains(std::nextafter(1.0, 2.0)));
  EXPECT_FALSE(base::any().contains(std::nan("")));
}

TEST(Number, ReadsBackAsTheSameDouble) {
  EXPECT_EQ(base::to_text(0.1), "0.1");
  EXPECT_EQ(base::to_text(24), "24");
  EXPECT_EQ(base::to_text(1e6), "1000000");
  for (const double v : {1.0 / 3, 1e-300, 6.02214076e23, -9.81, 1e15, 0.1 + 0.2, 123456789012345680000.0}) EXPECT_EQ(std::stod(base::to_text(v)), v);
}

TEST(Number, IsRoundedUpToTheEndOfAScale) {
  for (const auto& [value, end] : {std::pair{1.0, 1.0}, {1.01, 2.0}, {2.5, 5.0}, {5.1, 10.0}, {0.03, 0.05}, {700.0, 1000.0}, {0.1 + 0.1, 0.2}})
    EXPECT_DOUBLE_EQ(base::round_up(value), end) << value;
  EXPECT_DOUBLE_EQ(base::round_up(std::nextafter(2.0, 3.0)), 2.0);
}

TEST(Count, HasAnSUnlessItIsOne) {
  EXPECT_EQ(base::count_of(0, "frame"), "0 frames");
  EXPECT_EQ(base::count_of(1u, "frame"), "1 frame");
  EXPECT_EQ(base::count_of(12, "frame"), "12 frames");
}

TEST(EditDistance, CountsInsertedDeletedReplacedAndSwappedLetters) {
  EXPECT_EQ(base::edit_distance("cell", "cell"), 0u);
  EXPECT_EQ(base::edit_distance("cel", "cell"), 1u);
  EXPECT_EQ(base::edit_distance("ecll", "cell"), 1u);
  EXPECT_EQ(base::edit_distance("bell", "cell"), 1u);
  EXPECT_EQ(base::edit_distance("", "cell"), 4u);
  EXPECT_EQ(base::edit_distance("kitten", "sitting"), 3u);
}

TEST(Listed, HasAnAndBeforeTheLast) {
  const std::vector<std::string> words{"a", "b", "c"};
  EXPECT_EQ(base::listed(words), "a, b and c");
  EXPECT_EQ(base::listed(std::span(words).first(2)), "a and b");
  EXPECT_EQ(base::listed(std::span(words).first(1)), "a");
  EXPECT_EQ(base::listed({}), "");
}

TEST(NearestWord, IsEmptyWhenNothingIsNear) {
  const std::vector<std::string> words{"cell", "cfl", "domain"};
  EXPECT_EQ(base::nearest_word("cel", words), "cell");
  EXPECT_EQ(base::nearest_word("domian", words), "domain");
  EXPECT_EQ(base::nearest_word("CFL", words), "cfl");
  EXPECT_EQ(base::nearest_word("simulation", std::vector<std::string>{"shot", "sim"}), "sim");
  EXPECT_EQ(base::nearest_word("viscosity", words), "");
  EXPECT_EQ(base::nearest_word("dom", words), "domain");
  EXPECT_EQ(base::nearest_word("camera.pos", std::vector<std::string>{"camera.fov", "camera.position"}), "camera.position");
  EXPECT_EQ(base::nearest_word("ce", words), "");   // two letters begin too many words
  EXPECT_EQ(base::nearest_word("x", std::vector<std::string>{"y"}), "");
  EXPECT_EQ(base::nearest_word(std::string(100000, 'c'), words), "");
}
