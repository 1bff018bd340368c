// SPDX-License-Identifier: Apache-2.0
// The reader of the output is a full pipe, or a terminal that was stopped with Ctrl-S.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::unread_output_test {
namespace {

using namespace std::chrono_literals;

constexpr auto kEnd = 5s;

class Reader {
 public:
  virtual ~Reader() = default;
  virtual std::string path() const = 0;
  std::string read() {
    prepare();
    std::string text;
    std::array<char, 4096> part{};
    const auto end = std::chrono::steady_clock::now() + 1s;
    for (pollfd ready{fd_, POLLIN, 0}; std::chrono::steady_clock::now() < end && ::poll(&ready, 1, 300) > 0;) {
      const ssize_t size = ::read(fd_, part.data(), part.size());
      if (size <= 0) break;
      text.append(part.data(), static_cast<std::size_t>(size));
    }
    return text;
  }

 protected:
  virtual void prepare() {}
  int fd_ = -1;
};

class FullPipe : public Reader {
 public:
  explicit FullPipe(const std::filesystem::path& folder) : path_(folder / "pipe") {
    if (::mkfifo(path_.c_str(), 0600) != 0) throw std::runtime_error("mkfifo");
    // Opens both ends of the pipe, so that reading does not end.
    fd_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    const std::string block(512, 'x');
    while (::write(fd_, block.data(), block.size()) > 0) {
    }
    if (errno != EAGAIN) throw std::runtime_error("the pipe cannot be filled");
  }
  ~FullPipe() override { ::close(fd_); }
  std::string path() const override { return path_; }

 private:
  std::filesystem::path path_;
};

class StoppedTerminal : public Reader {
 public:
  explicit StoppedTerminal(const std::filesystem::path& /*folder*/) {
    fd_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (fd_ < 0 || ::grantpt(fd_) != 0 || ::unlockpt(fd_) != 0) throw std::runtime_error("no terminal");
    std::array<char, 64> name{};
    if (::ptsname_r(fd_, name.data(), name.size()) != 0) throw std::runtime_error("a terminal without a name");
    name_ = name.data();
    slave_ = ::open(name_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);  // a terminal needs an open slave
    press('\x13');
  }
  ~StoppedTerminal() override {
    ::close(slave_);
    ::close(fd_);
  }
  std::string path() const override { return name_; }

 private:
  void prepare() override { press('\x11'); }
  void press(char key) const {
    if (::write(fd_, &key, 1) != 1) throw std::runtime_error("the terminal takes no key");
  }

  std::string name_;
  int slave_ = -1;
};

std::vector<std::string> redirected(const std::string& stream, const Reader& reader, const std::string& name,
                                    const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {"-c", "exec \"$@\" " + stream + ">\"$0\"", reader.path(), program(name).string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

enum class Kind { kPipe, kTerminal };

class UnreadOutput : public ::testing::TestWithParam<Kind> {
 protected:
  std::string scene() const { return write(folder_.path() / "scene.toml", kPressingHand); }

  const testing::ScratchFolder folder_;
  const std::unique_ptr<Reader> reader_ = GetParam() == Kind::kPipe
                                              ? std::unique_ptr<Reader>(std::make_unique<FullPipe>(folder_.path()))
                                              : std::make_unique<StoppedTerminal>(folder_.path());
};

void expect_to_be_served(const std::string& server, const std::filesystem::path& folder) {
  Process wall(program("virtual_wall"), {"--server", server, "--duration-s", "1", "--json"}, folder);
  EXPECT_GT(count_in(wall.wait_for_line("summary"), "forces"), 50U);
  EXPECT_EQ(wall.wait(), 0);
}

TEST_P(UnreadOutput, OfTheLogLetsTheServerServeAndEnd) {
  Process server(
      "/bin/sh",
      redirected("2", *reader_, "tendond", {scene(), "--listen", "127.0.0.1:0", "--duration-s", "60", "--json"}),
      folder_.path());
  const std::string address = text_in(server.wait_for_line(R"("listening")"), "address");
  for (int i = 0; i < 3; ++i) expect_to_be_served(address, folder_.path());
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(kEnd), 0);
}

TEST_P(UnreadOutput, OfJsonLinesLetsTheServerServeAndEnd) {
  Process server(
      "/bin/sh",
      redirected("1", *reader_, "tendond", {scene(), "--listen", "127.0.0.1:0", "--duration-s", "60", "--json"}),
      folder_.path());
  const std::string line = server.wait_for_line("listens on ");
  const std::string address = line.substr(line.find("listens on ") + 11);
  for (int i = 0; i < 3; ++i) expect_to_be_served(address, folder_.path());
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(kEnd), 0);
  EXPECT_NE(server.err().find("stopped: "), std::string::npos) << server.err();
}

TEST_P(UnreadOutput, OfAClientLetsItDriveTheHandAndEnd) {
  Server server(folder_.path(), scene());
  Process wall("/bin/sh",
               redirected("2", *reader_, "virtual_wall", {"--server", server.address(), "--duration-s", "1", "--json"}),
               folder_.path());
  EXPECT_GT(count_in(wall.wait_for_line("summary", kEnd), "forces"), 50U);
  EXPECT_EQ(wall.wait(kEnd), 0);
}

TEST_P(UnreadOutput, OfAClientsJsonLinesLetsItEndAtASignal) {
  Server server(folder_.path(), scene());
  Process wall(
      "/bin/sh",
      redirected("1", *reader_, "virtual_wall", {"--server", server.address(), "--duration-s", "60", "--json"}),
      folder_.path());
  wall.wait_for_line("connected to");
  wall.signal(SIGTERM);
  EXPECT_EQ(wall.wait(kEnd), 0);
}

TEST_P(UnreadOutput, ThatIsReadAtLastSaysHowManyLinesAreMissing) {
  Server server(folder_.path(), scene());
  Process echo("/bin/sh",
               redirected("1", *reader_, "echo_motion",
                          {"--server", server.address(), "--rate-hz", "1000", "--duration-s", "60", "--json"}),
               folder_.path());
  echo.wait_for_line("connected to");
  std::this_thread::sleep_for(6s);  // about 600 kB
  std::string text = reader_->read();
  echo.signal(SIGTERM);
  EXPECT_EQ(echo.wait(kEnd), 0);
  const std::size_t told = text.find(R"({"event":"dropped","lines":)");
  ASSERT_NE(told, std::string::npos) << text.size() << " bytes";
  EXPECT_GT(count_in(text.substr(told), "lines"), 100U);
  EXPECT_NE(text.find("\"tick\"", told), std::string::npos) << "it goes on";
}

TEST_P(UnreadOutput, OfTheInjectorLetsItEndAtASignal) {
  for (const std::string stream : {"1", "2"}) {
    Process injector("/bin/sh",
                     redirected(stream, *reader_, "tendon-inject",
                                {"--listen", "127.0.0.1:0", "--to", "127.0.0.1:9", "--profile", "delay=1ms",
                                 "--duration-s", "60", stream == "1" ? "--json" : "--seed=1"}),
                     folder_.path());
    std::this_thread::sleep_for(1500ms);  // reports once a second
    injector.signal(SIGTERM);
    EXPECT_GE(injector.wait(kEnd), 0) << stream;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, UnreadOutput, ::testing::Values(Kind::kPipe, Kind::kTerminal),
                         [](const auto& instance) { return instance.param == Kind::kPipe ? "APipe" : "ATerminal"; });

}  // namespace
}  // namespace tendon::e2e::unread_output_test
