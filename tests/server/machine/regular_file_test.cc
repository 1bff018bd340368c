// SPDX-License-Identifier: Apache-2.0
#include "server/machine/regular_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::regular_file_test {
namespace {

using testing::ScratchFolder;

std::string refusal(const std::filesystem::path& file, std::string_view kind = {}) {
  return thrown_by<std::runtime_error>([&] { open_regular_file(file, kind); });
}

TEST(RegularFile, IsReadAlsoThroughALink) {
  const ScratchFolder folder;
  std::ofstream(folder.path() / "file") << "text";
  std::filesystem::create_symlink("file", folder.path() / "link");
  std::ifstream stream = open_regular_file(folder.path() / "link");
  std::string text;
  stream >> text;
  EXPECT_EQ(text, "text");
}

TEST(RegularFile, APipeADeviceAndADirectoryAreRefusedAtOnce) {
  const ScratchFolder folder;
  const std::string pipe = (folder.path() / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(refusal(pipe), "cannot read " + pipe + ": it is a named pipe, expected a regular file");
  EXPECT_EQ(refusal("/dev/zero"), "cannot read /dev/zero: it is a device, expected a regular file");
  EXPECT_EQ(refusal(folder.path()), "cannot read " + folder.path().string() + ": Is a directory");
}

TEST(RegularFile, SaysWhatItWasToBeAndWhyItCannotBeOpened) {
  EXPECT_EQ(refusal("no/such/file", "recording"), "cannot read recording no/such/file: No such file or directory");
}

}  // namespace
}  // namespace tendon::regular_file_test
