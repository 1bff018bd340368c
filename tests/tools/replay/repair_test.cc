// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/repair.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/server/recording/recording_samples.h"
#include "tests/server/scratch_folder.h"

namespace tendon::replay::repair_test {
namespace {

using tendon::testing::Contents;
using tendon::testing::ScratchFolder;

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string recording() {
  MemorySink sink;
  Recorder recorder(tendon::testing::sample_config(), sink);
  tendon::testing::record_samples(recorder, 2000);
  recorder.close();
  return {reinterpret_cast<const char*>(sink.bytes().data()), sink.bytes().size()};
}

Contents read(const std::filesystem::path& file) {
  RecordingReader reader(file);
  return tendon::testing::read_all(reader);
}

std::string repaired(const std::filesystem::path& from, const std::filesystem::path& to, bool json = false) {
  std::ostringstream out;
  repair({.recording = from, .out = to, .json = json}, out);
  return out.str();
}

TEST(Repair, WritesAWholeFileWithAllThatIsNotDamaged) {
  const ScratchFolder folder;
  const auto damaged = folder.path() / "run.mcap";
  const auto whole = folder.path() / "whole.mcap";
  std::string bytes = recording();
  char& middle = bytes[bytes.size() / 2 + 10'000];
  middle = static_cast<char>(middle ^ 0x40);
  std::ofstream(damaged, std::ios::binary) << bytes;
  const Contents before = read(damaged);
  ASSERT_LT(before.steps.size(), 2000U);
  ASSERT_GT(before.steps.size(), 1400U);
  const std::string said = repaired(damaged, whole);

  const Contents after = read(whole);
  EXPECT_EQ(after.error, "");
  EXPECT_FALSE(after.truncated);
  EXPECT_TRUE(after.damage.empty());
  EXPECT_EQ(after.scenes, before.scenes);
  ASSERT_EQ(after.steps.size(), before.steps.size());
  for (std::size_t i = 0; i < after.steps.size(); ++i)
    EXPECT_TRUE(tendon::testing::same(after.steps[i], before.steps[i]));
  ASSERT_EQ(after.datagrams.size(), before.datagrams.size());
  std::uint64_t lost = 0;
  for (const LossRecord& loss : after.losses) lost += loss.steps;
  EXPECT_EQ(lost, 2000 - after.steps.size());
  EXPECT_NE(said.find(std::to_string(lost) + " steps and "), std::string::npos) << said;
  EXPECT_NE(said.find("the CRC of a chunk does not match"), std::string::npos) << said;
}

TEST(Repair, GivesAFileThatWasCutOffItsEndAgain) {
  const ScratchFolder folder;
  const auto cut = folder.path() / "run.mcap";
  const std::string bytes = recording();
  std::ofstream(cut, std::ios::binary) << bytes.substr(0, bytes.size() / 2) + std::string(bytes.size() / 2, '\0');
  const Contents before = read(cut);
  ASSERT_TRUE(before.truncated);
  ASSERT_FALSE(before.steps.empty());
  const std::string said = repaired(cut, folder.path() / "whole.mcap", true);
  EXPECT_NE(said.find(R"("truncated":true,"damage":[])"), std::string::npos) << said;
  const Contents after = read(folder.path() / "whole.mcap");
  EXPECT_FALSE(after.truncated);
  EXPECT_EQ(after.steps.size(), before.steps.size());
}

TEST(Repair, OverwritesNothingAndChangesNotTheRecording) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  std::ofstream(file, std::ios::binary) << recording();
  EXPECT_THROW(repaired(file, file), std::runtime_error);
  std::ofstream(folder.path() / "notes.txt") << "mine";
  EXPECT_THROW(repaired(file, folder.path() / "notes.txt"), std::runtime_error);
  EXPECT_EQ(bytes_of(folder.path() / "notes.txt"), "mine");
  EXPECT_EQ(bytes_of(file), recording());
}

TEST(Repair, RefusesAFileOfWhichNothingCanBeReadAndLeavesNone) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  std::ofstream(file, std::ios::binary) << recording().substr(0, 100);
  EXPECT_THROW(repaired(file, folder.path() / "whole.mcap"), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "whole.mcap"));
}

}  // namespace
}  // namespace tendon::replay::repair_test
