// SPDX-License-Identifier: Apache-2.0
// Programs in C, Go and Octave with libtendon.so.1 at a real server, and what happens if such a program misbehaves.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::c_e2e_test {
namespace {

using testing::ScratchFolder;

const std::string kPrograms = TENDON_C_PROGRAMS;

/// kPressingHand pushes with 300 N/m from x = 15 mm against a wall of 2000 N/m at x = 0.
constexpr double kWallForce = -300 * 0.015 * 2000 / 2300;  // N
constexpr double kWallDepth = 300 * 15 / 2300.0;           // mm

struct Pressing {
  ScratchFolder folder;
  Server server{folder.path(), write(folder.path() / "hand.toml", kPressingHand), {"--without-limiter"}};
};

/// A server that requires a key.
struct Sealed {
  Sealed() {
    std::filesystem::create_directory(folder.path() / "keys");
    Process keygen(program("tendond"), {"keygen", "wall", "--out", key}, folder.path());
    EXPECT_EQ(keygen.wait(), 0) << keygen.err();
    server.emplace(folder.path(),
                   write(folder.path() / "lab.toml",
                         "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n[network]\nkeys = \"keys\"\n"));
  }
  ScratchFolder folder;
  std::string key = (folder.path() / "keys/wall.key").string();
  std::optional<Server> server;
};

/// Checks "x 1.96 mm, -3.91 N on the hand", the last line of the examples.
void expect_wall(const std::string& said) {
  double depth = 0;
  double force = 0;
  ASSERT_EQ(std::sscanf(said.c_str(), "x %lf mm, %lf N on the hand", &depth, &force), 2) << said;
  EXPECT_NEAR(depth, kWallDepth, 0.1 * kWallDepth) << said;
  EXPECT_NEAR(force, kWallForce, -0.1 * kWallForce) << said;
}

TEST(CExample, TheWallInCIsFelt) {
  Pressing pressing;
  Process wall(kPrograms + "/c_wall", {pressing.server.address(), "2000"}, pressing.folder.path());
  EXPECT_EQ(wall.wait(), 0) << wall.err();
  expect_wall(wall.out());
}

TEST(CExample, TheWallInGoIsFelt) {
  if (!std::filesystem::exists(kPrograms + "/go_wall")) GTEST_SKIP() << "skipped: golang-go is missing";
  Pressing pressing;
  Process wall(kPrograms + "/go_wall", {pressing.server.address()}, pressing.folder.path());
  EXPECT_EQ(wall.wait(), 0) << wall.err();
  expect_wall(wall.out());
}

TEST(CExample, TheWallInOctaveIsFelt) {
  if (!std::filesystem::exists(kPrograms + "/tendon_oct.oct")) GTEST_SKIP() << "skipped: octave-dev is missing";
  Pressing pressing;
  Process wall("/usr/bin/octave-cli",
               {"--norc", "--path", kPrograms, TENDON_C_EXAMPLES "/wall.m", pressing.server.address()},
               pressing.folder.path());
  EXPECT_EQ(wall.wait(), 0) << wall.err();
  expect_wall(wall.out());
}

TEST(CExample, WithoutAServerTheWallSaysSo) {
  const ScratchFolder folder;
  Process wall(kPrograms + "/c_wall", {"127.0.0.1:9"}, folder.path());
  EXPECT_EQ(wall.wait(), 1);
  EXPECT_EQ(wall.err(), "wall: no answer from 127.0.0.1:9; is tendond running there?\n");
}

/// The texts of the reports on late forces in 3 to 4 s, which the machine may cause. Less than one in 100 turns.
constexpr double kCallsOfReports = 24;

struct Version {
  int number;
  double state_size;
  std::string library_folder;
};

TEST(CAbi, ProgramsOfTheFirstAndTheNextHeaderRunWithBothLibraries) {
  const std::vector<Version> versions = {{1, 232, TENDON_C_LIBRARY}, {2, 232 + 64, TENDON_C_NEXT_LIBRARY}};
  for (const Version& program : versions) {
    for (const Version& library : versions) {
      SCOPED_TRACE("program " + std::to_string(program.number) + ", library " + std::to_string(library.number));
      Pressing pressing;
      Process wall(kPrograms + "/abi_program_" + std::to_string(program.number), {pressing.server.address()},
                   pressing.folder.path(), {"LD_LIBRARY_PATH=" + library.library_folder});
      ASSERT_EQ(wall.wait(), 0) << wall.err();
      const std::string& said = wall.out();
      EXPECT_EQ(number_in(said, "header"), program.number);
      EXPECT_EQ(number_in(said, "library"), library.number);
      EXPECT_EQ(number_in(said, "own_size"), program.state_size);
      EXPECT_EQ(number_in(said, "size"), std::min(program.state_size, library.state_size));
      EXPECT_EQ(number_in(said, "states"), 700);
      EXPECT_EQ(number_in(said, "sent"), 700);
      EXPECT_EQ(number_in(said, "changed"), 0) << "bytes behind the struct";
      EXPECT_EQ(number_in(said, "described"), 0);
      EXPECT_GT(number_in(said, "max_force"), 1);
      EXPECT_NEAR(number_in(said, "force_n"), kWallForce, -0.1 * kWallForce);
    }
  }
}

TEST(CHeap, WaitAndSendDoNotUseTheHeap) {
  Pressing pressing;
  Process counted(kPrograms + "/heap", {pressing.server.address(), "4000", "0"}, pressing.folder.path());
  ASSERT_EQ(counted.wait(), 0) << counted.err();
  EXPECT_EQ(number_in(counted.out(), "turns"), 3000) << counted.out();
  EXPECT_LE(number_in(counted.out(), "heap_calls"), kCallsOfReports) << counted.out();
  std::printf("%s", counted.out().c_str());
}

TEST(CHeap, ASlowProgramDoesNotUseItEither) {
  Pressing pressing;
  Process counted(kPrograms + "/heap", {pressing.server.address(), "40", "100000"}, pressing.folder.path());
  ASSERT_EQ(counted.wait(), 0) << counted.err();
  EXPECT_EQ(number_in(counted.out(), "turns"), 30) << counted.out();
  EXPECT_LE(number_in(counted.out(), "heap_calls"), kCallsOfReports) << counted.out();
  std::printf("%s", counted.out().c_str());
}

TEST(CHeap, ASealedSessionDoesNotUseItEither) {
  Sealed lab;
  Process counted(kPrograms + "/heap", {lab.server->address(), "4000", "0", lab.key}, lab.folder.path());
  ASSERT_EQ(counted.wait(), 0) << counted.err();
  EXPECT_EQ(number_in(counted.out(), "turns"), 3000) << counted.out();
  EXPECT_LE(number_in(counted.out(), "heap_calls"), kCallsOfReports) << counted.out();
  std::printf("%s", counted.out().c_str());
}

/// Starts the example in C and an observer, and waits until the force is applied.
struct Felt : Pressing {
  Felt() {
    watch_force(echo, [](double force) { return force < 0.8 * kWallForce; });
  }
  Client echo{"echo_motion", server.address(), folder.path(), {"--json"}};
  Process wall{kPrograms + "/c_wall", {server.address(), "1000000"}, folder.path()};
};

TEST(CBadPeer, AProgramKilledWithItsForceOnIsLetGo) {
  Felt felt;
  felt.wall.signal(SIGKILL);
  watch_force(felt.echo, [](double force) { return force == 0; });
}

TEST(CBadPeer, AProgramThatIsStoppedIsLetGoAndFeltAgainWhenItGoesOn) {
  Felt felt;
  felt.wall.signal(SIGSTOP);
  watch_force(felt.echo, [](double force) { return force == 0; });
  felt.wall.signal(SIGCONT);
  watch_force(felt.echo, [](double force) { return force < 0.8 * kWallForce; });
}

TEST(CBadPeer, AProgramThatFloodsAndNeverWaitsIsLetGoAndHoldsNobodyUp) {
  Felt felt;
  felt.wall.signal(SIGKILL);
  watch_force(felt.echo, [](double force) { return force == 0; });
  Process flood(kPrograms + "/flood", {felt.server.address()}, felt.folder.path());
  const std::string said = flood.wait_for_line("\"sent\"");
  EXPECT_GT(number_in(said, "sent"), 5'000) << said;
  EXPECT_EQ(flood.wait(), 0) << flood.err();
  watch_force(felt.echo, [](double force) { return force == 0; });
  Process again(kPrograms + "/c_wall", {felt.server.address(), "1000000"}, felt.folder.path());
  watch_force(felt.echo, [](double force) { return force < 0.8 * kWallForce; });
  const std::string end = felt.server.stop();
  std::printf("flood: %s; server: %s\n", said.c_str(), end.c_str());
}

TEST(CBadPeer, AProgramWithTheSameKeyReplacesTheFirstWhichEnds) {
  Sealed lab;
  Process first(kPrograms + "/heap", {lab.server->address(), "1000000", "0", lab.key}, lab.folder.path());
  ::usleep(500'000);
  Process second(kPrograms + "/heap", {lab.server->address(), "500", "0", lab.key}, lab.folder.path());
  EXPECT_EQ(second.wait(), 0) << second.err();
  EXPECT_EQ(first.wait(), 0);
  EXPECT_NE(text_in(first.out(), "why").find(" has ended the session: "), std::string::npos) << first.out();
}

}  // namespace
}  // namespace tendon::e2e::c_e2e_test
