// SPDX-License-Identifier: Apache-2.0
#include "tests/support/files.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

namespace tendon::files_test {
namespace {

class Files : public ::testing::Test {
 protected:
  Files() {
    std::string name = (std::filesystem::temp_directory_path() / "tendon-files-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  ~Files() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::filesystem::path pipe() const {
    const auto path = folder_ / "pipe";
    EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
    return path;
  }
  static std::string refused(const std::function<void()>& asked) {
    try {
      asked();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
};

TEST_F(Files, AnOutputIntoAFolderThatIsNotThereIsRefusedBeforeTheWork) {
  EXPECT_EQ(
      refused([&] { expect_replaceable(folder_ / "none" / "x.png", {"t_s,"}); }),
      "cannot write " + (folder_ / "none" / "x.png").string() + ": there is no folder " + (folder_ / "none").string());
  EXPECT_EQ(refused([&] { expect_replaceable("x.png", {"t_s,"}); }), "");
}

TEST_F(Files, AnOutputReplacesOnlyWhatTheToolWrites) {
  EXPECT_EQ(refused([&] { expect_replaceable(folder_ / "new.csv", {"t_s,"}); }), "");
  EXPECT_EQ(refused([&] { expect_replaceable(file("empty.csv", ""), {"t_s,"}); }), "");
  EXPECT_EQ(refused([&] { expect_replaceable(file("old.csv", "t_s,x_m\n"), {"law,", "t_s,"}); }), "");
  EXPECT_EQ(refused([&] { expect_replaceable("/dev/null", {"t_s,"}); }), "");
  const std::string why = refused([&] { expect_replaceable(file("scene.toml", "[device]\n"), {"t_s,"}); });
  EXPECT_NE(why.find("a file of another kind is there"), std::string::npos) << why;
  EXPECT_NE(refused([&] { expect_replaceable(pipe(), {"t_s,"}); }).find("it is a pipe"), std::string::npos);
  EXPECT_NE(refused([&] { expect_replaceable("/dev/full", {"t_s,"}); }).find("it is a device"), std::string::npos);
}

}  // namespace
}  // namespace tendon::files_test
