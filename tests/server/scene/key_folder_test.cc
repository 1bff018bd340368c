// SPDX-License-Identifier: Apache-2.0
#include "server/scene/key_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/server/scratch_folder.h"
#include "tests/support/full_disk.h"
#include "tests/support/refusal.h"

namespace tendon::key_folder_test {
namespace {

using testing::ScratchFolder;

ClientKey some_key(const std::string& name, std::uint64_t seed, Role role = Role::kController) {
  return {.name = name, .role = role, .key = Ratchet(seed).next()};
}

std::string complaint_about(const std::filesystem::path& folder) {
  return thrown_by<std::runtime_error>([&] { read_key_folder(folder); });
}

TEST(KeyFolder, GivesBackTheKeysThatWereWrittenByName) {
  const ScratchFolder folder;
  write_key_file(folder.path() / "wall.key", some_key("wall", 1));
  write_key_file(folder.path() / "screen.key", some_key("screen", 2, Role::kObserver));
  std::ofstream(folder.path() / "README") << "not a key";
  const auto keys = read_key_folder(folder.path());
  ASSERT_EQ(keys.size(), 2U);
  EXPECT_EQ(keys[0].name, "screen");
  EXPECT_EQ(keys[0].role, Role::kObserver);
  EXPECT_EQ(keys[1].name, "wall");
  EXPECT_EQ(keys[1].key.bytes(), some_key("wall", 1).key.bytes());
}

TEST(KeyFolder, AKeyIsWrittenForItsOwnerOnlyAndNeverOverAnother) {
  const ScratchFolder folder;
  const auto file = folder.path() / "wall.key";
  const mode_t before = umask(0);
  write_key_file(file, some_key("wall", 1));
  umask(before);
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0600));
  EXPECT_THROW(write_key_file(file, some_key("wall", 2)), std::runtime_error);
  EXPECT_EQ(read_key_folder(folder.path())[0].key.bytes(), some_key("wall", 1).key.bytes());
}

TEST(KeyFolder, AFullDiskLeavesNothingBehindAndTheRetryWorks) {
  const ScratchFolder folder;
  const auto file = folder.path() / "wall.key";
  std::string refusal;
  {
    const testing::FullDisk full(10);
    refusal = thrown_by<std::runtime_error>([&] { write_key_file(file, some_key("wall", 1)); });
  }
  EXPECT_EQ(refusal, "cannot write key file " + file.string() + ": File too large");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  write_key_file(file, some_key("wall", 1));
  EXPECT_EQ(read_key_folder(folder.path())[0].key.bytes(), some_key("wall", 1).key.bytes());
}

TEST(KeyFolder, ANamedPipeIsRefusedAndNotWaitedFor) {
  const ScratchFolder folder;
  const std::string pipe = (folder.path() / "wall.key").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(complaint_about(folder.path()),
            "cannot read key file " + pipe + ": it is a named pipe, expected a regular file");
}

TEST(KeyFolder, SaysWhichFileIsWrongAndWhy) {
  const ScratchFolder folder;
  const std::string file = (folder.path() / "wall.key").string();
  EXPECT_EQ(complaint_about(folder.path() / "none"),
            "cannot read key folder " + (folder.path() / "none").string() + ": No such file or directory");
  EXPECT_EQ(complaint_about(folder.path()),
            folder.path().string() +
                ": expected a key file for each client, found none; create one with `tendond keygen NAME`");
  write_key_file(file, some_key("wall", 1));
  std::filesystem::permissions(file, std::filesystem::perms(0640));
  EXPECT_TRUE(complaint_about(folder.path()).starts_with(file + ": other users can read or write this key"));
  std::filesystem::permissions(file, std::filesystem::perms(0600));
  std::ofstream(file) << "controller " << std::string(64, '0') << '\n';
  EXPECT_TRUE(complaint_about(folder.path()).starts_with(file + ": the key is weak: it repeats the same few bytes"));
  std::ofstream(file) << "controller 00\n";
  EXPECT_TRUE(complaint_about(folder.path()).starts_with(file + ": the key is too short"));
}

}  // namespace
}  // namespace tendon::key_folder_test
