// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/options.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>
#include <vector>

namespace tendon::options_test {
namespace {

struct Parsed {
  std::optional<int> exit_code;
  Options options;
  double stiffness = 2000;
  bool local_model = false;
  std::string out;
  std::string err;
};

Parsed parse(std::vector<const char*> words) {
  Parsed parsed;
  parsed.options.client = {.name = "virtual_wall", .rate_hz = 100};
  CommandLine line("A wall.", parsed.options);
  line.add("--stiffness-n-per-m", parsed.stiffness, "How hard it is");
  line.add("--local-model", parsed.local_model, "Send the stiffness");
  words.insert(words.begin(), "virtual_wall");
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  parsed.exit_code = line.parse(static_cast<int>(words.size()), words.data());
  parsed.out = testing::internal::GetCapturedStdout();
  parsed.err = testing::internal::GetCapturedStderr();
  return parsed;
}

TEST(CommandLine, NothingGivenLeavesTheDefaults) {
  const Parsed parsed = parse({});
  EXPECT_FALSE(parsed.exit_code);
  EXPECT_EQ(parsed.options.server.text(), "127.0.0.1:47100");
  EXPECT_EQ(parsed.options.client.rate_hz, 100);
  EXPECT_EQ(parsed.options.duration, Duration::zero());
  EXPECT_FALSE(parsed.options.json);
}

TEST(CommandLine, ReadsWhatIsGiven) {
  const Parsed parsed = parse({"--server", "[::1]:5000", "--rate-hz", "250.5", "--duration-s", "1.5", "--json",
                               "--stiffness-n-per-m", "800", "--local-model"});
  EXPECT_FALSE(parsed.exit_code);
  EXPECT_EQ(parsed.options.server.text(), "[::1]:5000");
  EXPECT_EQ(parsed.options.client.rate_hz, 250.5);
  EXPECT_EQ(parsed.options.duration, std::chrono::milliseconds(1500));
  EXPECT_TRUE(parsed.options.json);
  EXPECT_EQ(parsed.stiffness, 800);
  EXPECT_TRUE(parsed.local_model);
}

/// A program with the argument SHAPE and the option --reach-mm. Returns the exit code; `err` is the error message.
std::optional<int> parse_shape(std::vector<const char*> words, std::string& shape, double& reach, std::string& err) {
  Options options{.client = {.name = "shapes"}};
  CommandLine line("Shapes.", options);
  line.add_argument("SHAPE", shape, {"line", "plane"}, "The shape");
  line.add("--reach-mm", reach, "How far", 1);
  words.insert(words.begin(), "shapes");
  testing::internal::CaptureStderr();
  const std::optional<int> exit_code = line.parse(static_cast<int>(words.size()), words.data());
  err = testing::internal::GetCapturedStderr();
  return exit_code;
}

TEST(CommandLine, TakesOneOfTheChoicesAndNumbersFromTheLeastOn) {
  std::string shape, err;
  double reach = 8;
  EXPECT_FALSE(parse_shape({"plane", "--reach-mm", "1"}, shape, reach, err));
  EXPECT_EQ(shape, "plane");
  EXPECT_EQ(reach, 1);
  EXPECT_EQ(parse_shape({"circle"}, shape, reach, err), 2);
  EXPECT_NE(err.find("expected line or plane, got \"circle\""), std::string::npos) << err;
  EXPECT_EQ(parse_shape({}, shape, reach, err), 2);
  for (const char* const wrong : {"0", "0.9", "-1", "inf", "nan", "1x"}) {
    EXPECT_EQ(parse_shape({"line", "--reach-mm", wrong}, shape, reach, err), 2) << wrong;
    EXPECT_NE(err.find("expected a number of 1 or more, got \"" + std::string(wrong)), std::string::npos) << err;
  }
}

TEST(CommandLine, HelpShowsAnExampleAndLeavesWithZero) {
  const Parsed parsed = parse({"--help"});
  EXPECT_EQ(parsed.exit_code, 0);
  EXPECT_NE(parsed.out.find("Example: virtual_wall --server 127.0.0.1:47100"), std::string::npos) << parsed.out;
  EXPECT_NE(parsed.out.find("--stiffness-n-per-m"), std::string::npos);
}

TEST(CommandLine, WrongUsageLeavesWithTwoAndASentence) {
  const std::vector<std::vector<const char*>> wrong = {{"--server", "127.0.0.1"},
                                                       {"--server", "localhost:99999"},
                                                       {"--rate-hz", "-1"},
                                                       {"--rate-hz", "nan"},
                                                       {"--rate-hz", "fast"},
                                                       {"--rate-hz", "1e-9"},
                                                       {"--duration-s", "-3"},
                                                       {"--duration-s", "inf"},
                                                       {"--stiffness-n-per-m", "-5"},
                                                       {"--stiffness-n-per-m", "inf"},
                                                       {"--stiffness-n-per-m", "nan"},
                                                       {"--unknown"},
                                                       {"surplus"}};
  for (const auto& words : wrong) {
    const Parsed parsed = parse(words);
    EXPECT_EQ(parsed.exit_code, 2) << words.front() << " " << words.back();
    EXPECT_FALSE(parsed.err.empty());
    EXPECT_TRUE(parsed.out.empty());
  }
  EXPECT_NE(parse({"--server", "nowhere"}).err.find("expected HOST:PORT"), std::string::npos);
}

TEST(CommandLine, AMisspeltOptionIsNamedWithTheOneThatWasMeant) {
  EXPECT_EQ(parse({"--duraton-s", "1"}).err,
            "virtual_wall: unknown option --duraton-s; did you mean --duration-s? (see --help)\n");
}

TEST(CommandLine, AKeyThatIsAPipeOrAFolderIsRefusedAtOnce) {
  const std::string folder = ::testing::TempDir() + "tendon_key_" + std::to_string(::getpid());
  ASSERT_EQ(::mkdir(folder.c_str(), 0700), 0);
  const std::string pipe = folder + "/pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const Parsed of_pipe = parse({"--key", pipe.c_str()});
  const Parsed of_folder = parse({"--key", folder.c_str()});
  const Parsed of_nothing = parse({"--key", "/nowhere/at/all.key"});
  ::unlink(pipe.c_str());
  ::rmdir(folder.c_str());
  EXPECT_EQ(of_pipe.exit_code, 1);
  EXPECT_NE(of_pipe.err.find("cannot read key file " + pipe + ": it is not a regular file"), std::string::npos);
  EXPECT_EQ(of_folder.exit_code, 1);
  EXPECT_NE(of_folder.err.find("cannot read key file " + folder + ": it is a folder"), std::string::npos);
  EXPECT_EQ(of_nothing.exit_code, 1);
  EXPECT_NE(of_nothing.err.find("No such file or directory"), std::string::npos);
}

}  // namespace
}  // namespace tendon::options_test
