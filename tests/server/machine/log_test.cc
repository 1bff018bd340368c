// SPDX-License-Identifier: Apache-2.0
#include "server/machine/log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>

namespace tendon::log_test {
namespace {

using namespace std::chrono_literals;

class Written {
 public:
  Written() : before_(std::cerr.rdbuf(text_.rdbuf())) {}
  ~Written() { std::cerr.rdbuf(before_); }
  Written(const Written&) = delete;
  Written& operator=(const Written&) = delete;
  std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::streambuf* before_;
};

TEST(LogRate, AdmitsABurstThenALineASecondAndCountsTheOthers) {
  log::Rate rate;
  const LocalTime start(5s);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(rate.admit(start), 0U) << i;
  for (int i = 0; i < 7; ++i) EXPECT_EQ(rate.admit(start + 999ms), std::nullopt);
  EXPECT_EQ(rate.admit(start + 1s), 7U);
  EXPECT_EQ(rate.admit(start + 1s), std::nullopt);
  EXPECT_EQ(rate.admit(start + 1h), 1U);
}

TEST(Log, LimitsEachKindOfLineWhateverItsNumbersAndNames) {
  const Written written;
  for (int i = 0; i < 5000; ++i) {
    log::warn("refused a controller at 127.0.0." + std::to_string(i) + ": \"name " +
              std::string(static_cast<std::size_t>(i % 20), 'x') + "\"");
  }
  log::error("the device is on fire");
  const std::string text = written.text();
  EXPECT_LE(std::ranges::count(text, '\n'), 110) << "100 lines, and one for each second that this has taken";
  EXPECT_NE(text.find(" error the device is on fire\n"), std::string::npos);
  EXPECT_EQ(text[2], ':') << text.substr(0, 80);
  EXPECT_EQ(text[8], '.');
}

}  // namespace
}  // namespace tendon::log_test
