// SPDX-License-Identifier: Apache-2.0
#include "server/recording/byte_sink.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/server/recording/recording_samples.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/full_disk.h"
#include "tests/support/refusal.h"

namespace tendon::byte_sink_test {
namespace {

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

class FileSinkTest : public ::testing::Test {
 protected:
  const testing::ScratchFolder folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
};

TEST_F(FileSinkTest, LeavesTheFileOfAnotherRecordingThatStillRunsAlone) {
  const std::array<std::byte, 3> piece{};
  FileSink first(path);
  ASSERT_TRUE(first.append(piece));
  EXPECT_THROW(FileSink{path}, std::runtime_error);
  EXPECT_EQ(FileSink::open_new(path), nullptr);
  EXPECT_EQ(std::filesystem::file_size(path), 3U);
  ASSERT_TRUE(first.append(piece));
  EXPECT_EQ(std::filesystem::file_size(path), 6U);
}

TEST_F(FileSinkTest, SharesWhatHasNothingToLose) {
  FileSink one("/dev/null");
  FileSink other("/dev/null");
  const std::array<std::byte, 3> bytes{};
  EXPECT_TRUE(one.append(bytes));
  EXPECT_TRUE(other.append(bytes));
}

TEST_F(FileSinkTest, NamesPathAndReasonWhenItCannotOpen) {
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { FileSink sink("/nowhere/at/all/run.mcap"); }),
            "cannot write recording /nowhere/at/all/run.mcap: No such file or directory");
}

TEST_F(FileSinkTest, ReportsAFullDisk) {
  FileSink sink("/dev/full");
  EXPECT_EQ(sink.error(), "");
  EXPECT_FALSE(sink.append(bytes("abc")));
  EXPECT_EQ(sink.error(), "cannot write recording /dev/full: No space left on device");
}

TEST_F(FileSinkTest, NeverTouchesWhatWasThere) {
  { ASSERT_TRUE(FileSink(path).append(bytes("old and long"))); }
  EXPECT_EQ(FileSink::open_new(path), nullptr);
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { FileSink sink(path); }),
            "cannot write recording " + path.string() + ": the file already exists");
  EXPECT_EQ(std::filesystem::file_size(path), 12U);
}

TEST_F(FileSinkTest, TakesOverAnEmptyFile) {
  std::ofstream{path};
  ASSERT_TRUE(FileSink(path).append(bytes("new")));
  EXPECT_EQ(std::filesystem::file_size(path), 3U);
}

TEST_F(FileSinkTest, AnEmptyFileIsOneSinksOnly) {
  const FileSink first(path);
  EXPECT_EQ(FileSink::open_new(path), nullptr);
}

TEST_F(FileSinkTest, RefusesWhatIsNoFileAndDoesNotHang) {
  const auto pipe = folder.path() / "pipe.mcap";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto refusal = [](const std::filesystem::path& at) {
    return thrown_by<std::runtime_error>([&] { FileSink::open_new(at); });
  };
  const std::string cannot = "cannot write recording ";
  EXPECT_EQ(refusal(pipe), cannot + pipe.string() + ": it is a named pipe, expected a regular file");
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  EXPECT_EQ(refusal(pipe), cannot + pipe.string() + ": it is a named pipe, expected a regular file") << "with a reader";
  ::close(reader);
  EXPECT_EQ(refusal(folder.path()), cannot + folder.path().string() + ": Is a directory");
}

TEST_F(FileSinkTest, NoticesThatItsFileWasDeletedOrCutOff) {
  const auto outcome = [&](auto harm) {
    FileSink sink(path);
    EXPECT_TRUE(sink.append(bytes("0123")));
    harm();
    EXPECT_FALSE(sink.append(bytes("4567")));
    EXPECT_TRUE(sink.gone());
    std::filesystem::remove(path);
    return sink.error();
  };
  const std::string begin = "cannot write recording " + path.string() + ": it was ";
  EXPECT_EQ(outcome([&] { std::filesystem::remove(path); }), begin + "deleted in the meantime");
  EXPECT_EQ(outcome([&] { std::filesystem::resize_file(path, 0); }), begin + "truncated in the meantime");
}

TEST_F(FileSinkTest, WritesOnInAFileThatWasMovedAway) {
  FileSink sink(path);
  EXPECT_TRUE(sink.append(bytes("0123")));
  std::filesystem::rename(path, folder.path() / "kept.mcap");
  EXPECT_TRUE(sink.append(bytes("4567"))) << sink.error();
  EXPECT_EQ(std::filesystem::file_size(folder.path() / "kept.mcap"), 8U);
}

TEST_F(FileSinkTest, CutsOffAPieceThatDidNotFit) {
  FileSink sink(path);
  ASSERT_TRUE(sink.append(bytes("whole")));
  {
    const testing::FullDisk disk(8);  // accepts only a part of the write
    EXPECT_FALSE(sink.append(bytes("too long")));
  }
  EXPECT_NE(sink.error().find("File too large"), std::string::npos) << sink.error();
  EXPECT_EQ(std::filesystem::file_size(path), 5U);
  EXPECT_TRUE(sink.append(bytes("!")));
  EXPECT_EQ(std::filesystem::file_size(path), 6U);
}

}  // namespace
}  // namespace tendon::byte_sink_test
