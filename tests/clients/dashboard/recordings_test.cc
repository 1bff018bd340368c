// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/recordings.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::dash::recordings_test {
namespace {

namespace fs = std::filesystem;

class RecordingsTest : public ::testing::Test {
 protected:
  RecordingsTest() {
    fs::create_directory(folder_ / "below");
    fs::create_directory(folder_ / "folder.mcap");
    for (const char* name : {"a.mcap", "b b.mcap", "grün.mcap", ".hidden.mcap", "notes.txt", ".mcap", "below/c.mcap",
                             "new\nline.mcap", "\xff.mcap"}) {
      std::ofstream(folder_ / name) << "0123456789";
    }
    fs::create_symlink(folder_ / "notes.txt", folder_ / "link.mcap");
  }
  tendon::testing::ScratchFolder scratch_;
  fs::path folder_ = scratch_.path();
  Recordings recordings_{folder_};
};

TEST_F(RecordingsTest, ListsWhatAPersonMayOpenNewestFirst) {
  const auto old = fs::last_write_time(folder_ / "grün.mcap") - std::chrono::hours(1);
  fs::last_write_time(folder_ / "a.mcap", old);
  fs::last_write_time(folder_ / "b b.mcap", old - std::chrono::hours(1));
  const auto entries = recordings_.list();
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[0].name, "grün.mcap");
  EXPECT_EQ(entries[1].name, "a.mcap");
  EXPECT_EQ(entries[2].name, "b b.mcap");
  EXPECT_EQ(entries[1].size, 10U);
  EXPECT_NEAR(entries[1].modified_unix_s - entries[2].modified_unix_s, 3600, 1e-3);
}

TEST_F(RecordingsTest, OpensByNameAndByNothingElse) {
  const auto file = recordings_.open("a.mcap");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->size(), 10U);
  EXPECT_EQ(file->read(2, 3), "234");
  EXPECT_EQ(file->read(8, 100), "89");
  EXPECT_EQ(file->read(10, 1), "");
  for (const std::string& name : std::vector<std::string>{"", ".", "..", "/", "b", "notes.txt", ".hidden.mcap", ".mcap",
                                                          "link.mcap", "folder.mcap", "below/c.mcap", "./a.mcap",
                                                          "../" + folder_.filename().string() + "/a.mcap",
                                                          "new\nline.mcap", "\xff.mcap", "a.mcap/", "nothing.mcap"}) {
    EXPECT_FALSE(recordings_.open(name)) << name;
  }
  EXPECT_FALSE(recordings_.open((folder_ / "a.mcap").string()));
  EXPECT_FALSE(recordings_.open(std::string_view("a.mcap\0.mcap", 12)));
}

TEST(Recordings, SaysWhichFolderIsNone) {
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { const Recordings none("/nowhere/at/all"); }),
            "/nowhere/at/all: not a folder");
}

TEST(ByteRange, IsReadAsRfc9110Says) {
  using Range = std::variant<WholeFile, ByteRange, Unsatisfiable>;
  EXPECT_EQ(parse_range("bytes=0-499", 10000), Range(ByteRange{0, 500}));
  EXPECT_EQ(parse_range("bytes=500-999", 10000), Range(ByteRange{500, 500}));
  EXPECT_EQ(parse_range("bytes=-500", 10000), Range(ByteRange{9500, 500}));
  EXPECT_EQ(parse_range("bytes=9500-", 10000), Range(ByteRange{9500, 500}));
  EXPECT_EQ(parse_range("bytes=0-0", 10000), Range(ByteRange{0, 1}));
  EXPECT_EQ(parse_range("bytes=9999-20000", 10000), Range(ByteRange{9999, 1}));
  EXPECT_EQ(parse_range("bytes=-20000", 10000), Range(ByteRange{0, 10000}));
  EXPECT_EQ(parse_range("bytes=0-18446744073709551615", 10000), Range(ByteRange{0, 10000}));
  for (const char* beyond : {"bytes=10000-", "bytes=10000-10001", "bytes=-0"}) {
    EXPECT_EQ(parse_range(beyond, 10000), Range(Unsatisfiable{})) << beyond;
  }
  EXPECT_EQ(parse_range("bytes=0-", 0), Range(Unsatisfiable{}));
  for (const char* other : {"", "bytes", "bytes=", "bytes=-", "bytes=5-4", "bytes=0-1,3-4", "lines=0-1", "bytes=a-b",
                            "bytes=+1-2", "bytes= 1-2", "bytes=0x1-2", "bytes=1--2", "bytes=99999999999999999999-"}) {
    EXPECT_EQ(parse_range(other, 10000), Range(WholeFile{})) << other;
  }
}

}  // namespace
}  // namespace tendon::dash::recordings_test
