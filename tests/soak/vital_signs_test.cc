// SPDX-License-Identifier: Apache-2.0
#include "tests/soak/vital_signs.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <thread>

namespace tendon::soak::vital_signs_test {
namespace {

constexpr VitalSigns kGrowth{.resident = 1000};

std::vector<VitalSigns> fifty(std::size_t VitalSigns::*sign, std::size_t from, std::size_t each) {
  std::vector<VitalSigns> looks;
  for (std::size_t i = 0; i < 50; ++i) {
    VitalSigns look{.resident = 100'000, .files = 7, .threads = 4};
    look.*sign = from + i * each;
    looks.push_back(look);
  }
  return looks;
}

TEST(VitalSigns, OfAProcessAreWhatItHas) {
  const auto before = vital_signs(getpid());
  ASSERT_TRUE(before);
  const int file = open("/dev/null", O_RDONLY | O_CLOEXEC);
  std::atomic<bool> stop{false};
  std::thread thread([&stop] { stop.wait(false); });
  std::vector<char> memory(std::size_t{64} << 20, 'x');
  const auto after = vital_signs(getpid());
  stop = true;
  stop.notify_one();
  thread.join();
  close(file);
  ASSERT_TRUE(after);
  EXPECT_EQ(after->files, before->files + 1);
  EXPECT_EQ(after->threads, before->threads + 1);
  EXPECT_GE(after->resident + 1, before->resident + memory.size()) << memory.back();
}

TEST(VitalSigns, OfNobodyAreNone) { EXPECT_FALSE(vital_signs(-1)); }

TEST(VitalSigns, AreFlatWhenNothingGrows) {
  EXPECT_FALSE(not_flat("it", fifty(&VitalSigns::files, 7, 0), kGrowth));
  EXPECT_FALSE(not_flat("it", fifty(&VitalSigns::resident, 100'000, 30), kGrowth)) << "by 600 bytes: allowed";
}

TEST(VitalSigns, MayGrowUntilTheRunIsWarm) {
  auto looks = fifty(&VitalSigns::files, 7, 0);
  for (std::size_t i = 0; i < 10; ++i) looks[i].files = 3;
  EXPECT_FALSE(not_flat("it", looks, kGrowth));
}

TEST(VitalSigns, SayWhatGrew) {
  EXPECT_EQ(not_flat("it", fifty(&VitalSigns::files, 7, 1), kGrowth), "it: open files grew from 36 to 56");
  EXPECT_EQ(not_flat("it", fifty(&VitalSigns::threads, 4, 1), kGrowth), "it: threads grew from 33 to 53");
  EXPECT_EQ(not_flat("it", fifty(&VitalSigns::resident, 100'000, 100), kGrowth),
            "it: bytes of memory grew from 102900 to 104900");
}

TEST(VitalSigns, ThatWereLookedAtTooRarelySayNothing) {
  auto looks = fifty(&VitalSigns::files, 7, 1);
  looks.resize(9);
  EXPECT_FALSE(not_flat("it", looks, kGrowth));
}

}  // namespace
}  // namespace tendon::soak::vital_signs_test
