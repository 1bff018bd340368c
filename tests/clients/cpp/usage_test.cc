// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/usage.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tendon::usage_test {
namespace {

enum class Motion : std::uint8_t { kPose = 3, kTwist = 5 };

struct Tool {
  CLI::App app{"Compares runs.", "tool"};
  CLI::App* compare = nullptr;
  double rate = 100;
  std::vector<double> at;
  std::vector<std::string> runs;
  Motion motion = Motion::kPose;
  std::string side = "left";

  Tool() {
    usage::dress(app);
    app.require_subcommand(1);
    compare = app.add_subcommand("compare", "Compares them");
    app.add_subcommand("boundary", "How stiff");
    compare->add_option("RUN", runs, "runs")->required();
    compare->add_option("--rate-hz", rate, "How often")->check(CLI::Range(0.0, 1e9))->capture_default_str();
    compare->add_option("--at", at, "Where")->type_name("X,Y,Z")->delimiter(',')->expected(3);
    compare->add_option("--motion", motion, "What is sent")
        ->transform(usage::one_of(std::map<std::string, Motion>{{"pose", Motion::kPose}, {"twist", Motion::kTwist}}));
    compare->add_option("--side", side, "Of the hands")->check(usage::one_of({"left", "right", "both"}));
  }

  int parse(std::vector<const char*> words) {
    words.insert(words.begin(), "tool");
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    int code = 0;
    try {
      usage::parse(app, static_cast<int>(words.size()), words.data());
    } catch (const CLI::ParseError& error) {
      code = usage::exit_code(app, error);
    }
    out = testing::internal::GetCapturedStdout();
    err = testing::internal::GetCapturedStderr();
    return code;
  }
  std::string out;
  std::string err;
};

TEST(Usage, NamesTheCommandThatWasMeantEvenBeforeItsOptions) {
  Tool tool;
  EXPECT_EQ(tool.parse({"comparee", "--rate-hz", "5"}), 2);
  EXPECT_EQ(tool.err, "tool: unknown command \"comparee\"; did you mean compare? (see --help)\n");
  EXPECT_EQ(tool.parse({"report"}), 2);
  EXPECT_EQ(tool.err, "tool: unknown command \"report\"; expected one of compare, boundary (see --help)\n");
}

TEST(Usage, NamesTheOptionThatWasMeant) {
  Tool tool;
  EXPECT_EQ(tool.parse({"compare", "a", "--rat-hz=5"}), 2);
  EXPECT_EQ(tool.err, "tool: unknown option --rat-hz; did you mean --rate-hz? (see --help)\n");
  EXPECT_EQ(tool.parse({"--speed", "compare", "a"}), 2);
  EXPECT_EQ(tool.err, "tool: unknown option --speed (see --help)\n");
}

TEST(Usage, AnUnknownOptionIsNamedBeforeWhatIsMissing) {
  Tool tool;
  EXPECT_EQ(tool.parse({"compare", "--rat-hz", "5"}), 2);
  EXPECT_NE(tool.err.find("unknown option --rat-hz"), std::string::npos) << tool.err;
}

TEST(Usage, NamesTheWordsThatAnOptionTakesAndTheOneThatWasMeant) {
  Tool tool;
  EXPECT_EQ(tool.parse({"compare", "a", "--motion", "wrist"}), 2);
  EXPECT_EQ(tool.err, "tool: --motion: expected pose or twist, got \"wrist\" (see --help)\n");
  EXPECT_EQ(tool.parse({"compare", "a", "--motion", "twsit"}), 2);
  EXPECT_EQ(tool.err, "tool: --motion: expected pose or twist, got \"twsit\"; did you mean twist? (see --help)\n");
  EXPECT_EQ(tool.parse({"compare", "a", "--side", "middle"}), 2);
  EXPECT_EQ(tool.err, "tool: --side: expected left, right, both, got \"middle\" (see --help)\n");
}

TEST(Usage, AWordBecomesItsEnumerator) {
  Tool tool;
  EXPECT_EQ(tool.parse({"compare", "a", "--motion", "twist", "--side", "both"}), 0) << tool.err;
  EXPECT_EQ(tool.motion, Motion::kTwist);
  EXPECT_EQ(tool.side, "both");
}

TEST(Usage, TheHelpHasNoneOfTheLibrarysOwnNotation) {
  Tool tool;
  EXPECT_EQ(tool.parse({"compare", "--help"}), 0);
  for (const char* const wanted : {"tool compare [OPTIONS] RUN...\n", "--rate-hz NUMBER [100] ", "--at X,Y,Z ",
                                   "--motion pose|twist ", "--side left|right|both "}) {
    EXPECT_NE(tool.out.find(wanted), std::string::npos) << wanted << '\n' << tool.out;
  }
  for (const char* const leftover : {"FLOAT", "TEXT", " in [", "{", "REQUIRED", " x 3", "=100"}) {
    EXPECT_EQ(tool.out.find(leftover), std::string::npos) << leftover << '\n' << tool.out;
  }
}

struct Said {
  double duration_s = 7;
  int count = 0;
  std::uint64_t seed = 0;
  int offset = 0;
  std::string name = "none";
  std::vector<double> pair;
  bool json = false;
};

std::string refusal(std::vector<const char*> words) {
  Said said;
  CLI::App app("A tool (1,5)", "tool");
  CLI::App* const verb = app.add_subcommand("verb");
  for (CLI::App* const each : {&app, verb}) {
    each->add_option("--duration-s", said.duration_s);
    each->add_option("--count", said.count)->check(CLI::Range(0, 9));
    each->add_option("--seed", said.seed);
    each->add_option("--offset", said.offset);
    each->add_option("--name", said.name);
    each->add_option("--pair", said.pair)->delimiter(',')->expected(2);
    each->add_flag("--json", said.json);
  }
  words.insert(words.begin(), "tool");
  try {
    usage::parse(app, static_cast<int>(words.size()), words.data());
  } catch (const CLI::CallForHelp&) {
    return "help";
  } catch (const CLI::ParseError& error) {
    EXPECT_NE(error.get_exit_code(), 0);
    return usage::problem(app, error);
  }
  return "none";
}

TEST(CommandLines, AnEmptyTextIsNoValue) {
  const std::string why = ": expected a value, got an empty text";
  EXPECT_EQ(refusal({"--duration-s", ""}), "--duration-s" + why);
  EXPECT_EQ(refusal({"--count", ""}).substr(0, 7), "--count");
  EXPECT_EQ(refusal({"--name", ""}), "--name" + why);
  EXPECT_EQ(refusal({"--pair", "1", ""}), "--pair" + why);
  EXPECT_EQ(refusal({"verb", "--duration-s", ""}), "--duration-s" + why);
  EXPECT_NE(refusal({"--duration-s="}), "none");
  EXPECT_EQ(refusal({"--duration-s", "0", "--json", "--pair", "1,2", "verb", "--name", "a", "--json"}), "none");
}

TEST(CommandLines, ANegativeCountIsRefused) {
  EXPECT_EQ(refusal({"--seed", "-1"}), "--seed: expected a whole number from 0, got -1");
  EXPECT_EQ(refusal({"verb", "--seed", "-1"}), "--seed: expected a whole number from 0, got -1");
  EXPECT_EQ(refusal({"--seed", "1", "--offset", "-1"}), "none");
}

TEST(CommandLines, ADecimalCommaIsNamed) {
  EXPECT_EQ(refusal({"--duration-s", "1,5"}), "Could not convert: --duration-s = 1,5 (a decimal point?)");
  EXPECT_TRUE(refusal({"verb", "--count", "1,5"}).ends_with(" (a decimal point?)"));
  EXPECT_EQ(refusal({"--duration-s", "x"}), "Could not convert: --duration-s = x");
  EXPECT_EQ(refusal({"--help"}), "help");
}

}  // namespace
}  // namespace tendon::usage_test
