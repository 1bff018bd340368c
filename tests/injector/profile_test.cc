// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/profile.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace tendon::injector {
namespace {

using namespace std::chrono_literals;

/// What `call` complains about; "" when it does not.
template <typename Call>
std::string complaint_of(Call call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

std::string complaint_about(const Profile& profile) {
  return complaint_of([&] { check(profile); });
}

std::string complaint_about(const std::string& line) {
  return complaint_of([&] { parse_profile(line); });
}

/// A file that is gone at the end of the test.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& content)
      : path_(std::filesystem::path(testing::TempDir()) /
              (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".csv")) {
    std::ofstream(path_) << content;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TEST(Profile, ReadsAndWritesTheLineOfTheManual) {
  Profile profile;
  profile.base = 5ms;
  profile.delay = LognormalDelay{20ms, 5ms};
  profile.rho = 0.9;
  profile.loss = BurstLoss{0.02, 4};
  profile.spikes = {{{.at = 15s, .every = 15s, .lasts = 50ms}, 80ms}};
  profile.bottleneck.bits_per_second = 10'000'000;
  profile.bottleneck.queue = 64'000;
  profile.bottleneck.queue_in_bytes = true;
  const std::string line =
      "base=5ms delay=lognormal(20ms,5ms) rho=0.9 loss=burst(2%,4) spike(every=15s,for=50ms,80ms) rate=10Mbit/s "
      "queue=64kB";
  EXPECT_EQ(to_string(profile), line);
  EXPECT_EQ(parse_profile(line), profile);
}

TEST(Profile, AnEmptyLineIsAPerfectNetwork) {
  EXPECT_EQ(parse_profile(""), Profile{});
  EXPECT_EQ(to_string(Profile{}), "base=0ms");
}

TEST(Profile, RefusesTheImpossibleByFieldValueAndExpectation) {
  Profile p;
  p.base = -1ms;
  EXPECT_EQ(complaint_about(p), "base is -1ms, expected 0ms to 60s");
  p = {};
  p.loss = RandomLoss{1.5};
  EXPECT_EQ(complaint_about(p), "loss is 150%, expected a probability from 0% to 100%");
}

TEST(Profile, RefusesALineItDoesNotUnderstandAndSaysWhere) {
  EXPECT_EQ(complaint_about("delay=20"),
            "delay is \"20\", expected a number with its unit like 20ms (ns, us, ms or s)");
  EXPECT_EQ(complaint_about("loss=1% loss=2%"), "loss is given twice, expected once");
}

}  // namespace
}  // namespace tendon::injector
