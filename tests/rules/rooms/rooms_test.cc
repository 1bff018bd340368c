// SPDX-License-Identifier: Apache-2.0
// The last test checks this tree. Each of the other tests checks a small tree in which one rule is violated.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "tests/rules/rooms/room_rules.h"

namespace tendon::rooms::rooms_test {
namespace {

const std::string kLicence = "// SPDX-License-Identifier: Apache-2.0\n";
const std::string kHeader = kLicence + "#pragma once\n";

/// Returns "path:line" of all findings for one file in an otherwise correct tree.
std::vector<std::string> places(const std::string& path, const std::string& text) {
  const auto room = path.substr(0, path.find('/'));
  std::vector<std::string> places;
  for (const auto& finding : check({{path, text}, {room + "/README.md", ""}})) {
    places.push_back(finding.path + ":" + std::to_string(finding.line));
  }
  return places;
}

using Places = std::vector<std::string>;

TEST(Rooms, CoreSeesNobody) {
  for (const std::string room : {"protocol", "devices", "server", "clients/cpp", "tests/support"}) {
    EXPECT_EQ(places("core/a.cc", kLicence + "\n#include \"" + room + "/z.h\"\n"), Places{"core/a.cc:3"}) << room;
  }
  EXPECT_EQ(places("core/a.cc", kLicence + "#include \"core/z.h\"\n"), Places{});
}

TEST(Rooms, ProtocolAndDevicesSeeCoreButNotEachOther) {
  EXPECT_EQ(places("protocol/a.cc", kLicence + "#include \"core/z.h\"\n#include \"devices/z.h\"\n"),
            Places{"protocol/a.cc:3"});
  EXPECT_EQ(places("devices/a.cc", kLicence + "#include \"core/z.h\"\n#include \"protocol/z.h\"\n"),
            Places{"devices/a.cc:3"});
}

TEST(Rooms, NobodySeesTheServerOrTheTests) {
  for (const std::string room : {"core", "protocol", "devices", "clients/cpp"}) {
    const auto path = room + "/a.h";
    EXPECT_EQ(places(path, kHeader + "#include \"server/z.h\"\n#include \"tests/z.h\"\n"),
              (Places{path + ":3", path + ":4"}));
  }
  EXPECT_EQ(places("server/a.h", kHeader + "#include \"tests/z.h\"\n#include \"clients/cpp/z.h\"\n"),
            (Places{"server/a.h:3", "server/a.h:4"}));
}

TEST(Rooms, TheServerSeesProtocolCoreAndDevices) {
  EXPECT_EQ(
      places("server/a.cc", kLicence + "#include \"core/z.h\"\n#include \"protocol/z.h\"\n#include \"devices/z.h\"\n"),
      Places{});
}

TEST(Rooms, AClientSeesProtocolAndItsOwnFolder) {
  EXPECT_EQ(places("clients/cpp/a.cc", kLicence + "#include \"clients/cpp/z.h\"\n#include \"protocol/z.h\"\n"),
            Places{});
  EXPECT_EQ(places("clients/cpp/a.cc", kLicence + "#include \"core/z.h\"\n#include \"clients/softbody/z.h\"\n"),
            (Places{"clients/cpp/a.cc:2", "clients/cpp/a.cc:3"}));
  EXPECT_EQ(places("clients/softbody/a.cc", kLicence + "#include \"clients/cpp/z.h\"\n#include \"clients/dash/z.h\"\n"),
            Places{"clients/softbody/a.cc:3"});
}

TEST(Rooms, EverybodyMayKnowWhatArithmeticIs) {
  for (const std::string path : {"core/a.cc", "protocol/a.cc", "devices/a.cc", "server/a.cc", "clients/cpp/a.cc"}) {
    EXPECT_EQ(places(path, kLicence + "#include \"core/base/arithmetic.h\"\n"), Places{}) << path;
  }
}

TEST(Rooms, TestsSeeAll) {
  EXPECT_EQ(places("tests/a.cc", kLicence + "#include <asio.hpp>\n#include <thread>\n#include \"server/z.h\"\n"),
            Places{});
}

TEST(Rooms, AnAngleBracketHidesNothing) {
  EXPECT_EQ(places("core/a.cc", kLicence + "  #  include   <server/z.h>\n"), Places{"core/a.cc:2"});
}

TEST(Rooms, OurOwnHeadersAreNamedFromTheRoot) {
  EXPECT_EQ(places("core/a.cc", kLicence + "#include \"z.h\"\n#include \"../server/z.h\"\n"),
            (Places{"core/a.cc:2", "core/a.cc:3"}));
}

TEST(Rooms, EveryLibraryHasOneFrontDoor) {
  struct Case {
    std::string header;
    std::string door;
  };
  for (const auto& [header, door] :
       std::vector<Case>{{"asio/ip/udp.hpp", "server/machine/udp_link.cc"},
                         {"asio.hpp", "clients/cpp/udp_transport.cc"},
                         {"CLI/CLI.hpp", "server/main.cc"},
                         {"CLI/CLI.hpp", "clients/softbody/softbody_main.cc"},
                         {"google/protobuf/arena.h", "clients/dashboard/foxglove_message.cc"},
                         {"tendon.pb.h", "clients/dashboard/foxglove_message.cc"},
                         {"recording.pb.h", "server/recording/recording_codec.cc"},
                         {"libusb.h", "devices/usb/with_libusb.cc"},
                         {"nlohmann/json.hpp", "clients/cpp/run.cc"},
                         {"sodium.h", "protocol/secrets/crypto.cc"},
                         {"sodium.h", "devices/falcon/firmware.cc"},
                         {"toml++/toml.h", "server/scene/read.cc"},
                         {"zlib.h", "server/recording/mcap_format.cc"}}) {
    const auto text = kLicence + "#include <" + header + ">\n";
    EXPECT_EQ(places(door, text), Places{}) << header;
    for (const std::string path : {"core/a.cc", "protocol/a.cc", "devices/a.cc", "server/a.cc", "clients/cpp/a.cc"}) {
      EXPECT_EQ(places(path, text), Places{path + ":2"}) << header;
    }
  }
  EXPECT_EQ(places("protocol/a.cc", kLicence + "#include \"tendon.pb.h\"\n"), Places{"protocol/a.cc:2"});
}

TEST(Rooms, ALibraryWithoutAFrontDoorIsNotedAtOnce) {
  EXPECT_EQ(places("server/a.cc", kLicence + "#include <boost/asio.hpp>\n#include <curl/curl.h>\n#include <math.h>\n"),
            (Places{"server/a.cc:2", "server/a.cc:3", "server/a.cc:4"}));
  EXPECT_EQ(places("server/a.cc", kLicence + "#include <vector>\n#include <sys/mman.h>\n#include <poll.h>\n"),
            Places{});
}

TEST(Rooms, CoreIsMathematics) {
  for (const std::string header : {"thread", "mutex", "chrono", "iostream", "fstream", "random", "sys/socket.h",
                                   "unistd.h", "filesystem", "condition_variable", "ctime", "cstdio"}) {
    EXPECT_EQ(places("core/a.h", kHeader + "#include <" + header + ">\n"), Places{"core/a.h:3"}) << header;
  }
  EXPECT_EQ(places("core/a.h", kHeader + "#include <Eigen/Core>\n#include <cmath>\n#include <atomic>\n"), Places{});
  EXPECT_EQ(places("core/base/time.h", kHeader + "#include <chrono>\n"), Places{});
}

TEST(Rooms, ProtocolDoesNoInputOrOutput) {
  for (const std::string header : {"thread", "mutex", "iostream", "fstream", "sys/socket.h", "poll.h"}) {
    EXPECT_EQ(places("protocol/a.h", kHeader + "#include <" + header + ">\n"), Places{"protocol/a.h:3"}) << header;
  }
}

TEST(Rooms, OnlyTheClockFilesReadAClock) {
  for (const std::string call : {"std::chrono::steady_clock::now()", "Clock :: now ( )",
                                 "clock_gettime(CLOCK_MONOTONIC, &t)", "std::time(nullptr)", "std::clock()"}) {
    const auto text = kLicence + "auto t = " + call + ";\n";
    for (const std::string path : {"core/a.cc", "server/network_loop.cc", "devices/a.cc", "protocol/a.cc",
                                   "clients/cpp/force_client.cc", "tests/tools/worlds/world.cc"}) {
      EXPECT_EQ(places(path, text), Places{path + ":2"}) << call;
    }
    for (const std::string path : {"server/machine/clock.cc", "clients/cpp/machine.cc", "tests/tools/bench/bench.cc"}) {
      EXPECT_EQ(places(path, text), Places{}) << call;
    }
  }
}

TEST(Rooms, NobodyDrawsFromADistributionOfTheStandardLibrary) {
  EXPECT_EQ(places("tests/a.cc", kLicence + "std::uniform_real_distribution<double> d;\n"), Places{"tests/a.cc:2"});
  EXPECT_EQ(places("server/a.cc", kLicence + "\nstd::normal_distribution d;\n"), Places{"server/a.cc:3"});
}

TEST(Rooms, NobodySharesOwnership) {
  EXPECT_EQ(places("server/a.h", kHeader + "std::shared_ptr<int> a;\nauto z = std::make_shared<int>();\n"),
            (Places{"server/a.h:3", "server/a.h:4"}));
}

TEST(Rooms, OneFileParsesCommandLines) {
  EXPECT_EQ(places("server/a.cc", kLicence + "app.parse(argc, argv);\n"), Places{"server/a.cc:2"});
  EXPECT_EQ(places("clients/cpp/a.cc", kLicence + "usage::parse(parser_->app, argc, argv);\n"), Places{});
}

TEST(Rooms, APeersWordsArePrintedThroughVisible) {
  for (const std::string words : {"hello.name", "client->name", "welcome_.name", "stats.reason", "report->words"}) {
    EXPECT_EQ(places("server/a.cc", kLicence + "std::cerr << \"it said \" << " + words + ";\n"),
              Places{"server/a.cc:2"});
    EXPECT_EQ(places("server/a.cc", kLicence + "std::cerr << visible(" + words + ");\n"), Places{});
  }
  EXPECT_EQ(places("server/a.cc", kLicence + "std::cerr << options.client.name;\n"), Places{});
}

TEST(Rooms, AHeaderOpensNoNamespaceForOthers) {
  EXPECT_EQ(places("core/a.h", kHeader + "using  namespace std;\n"), Places{"core/a.h:3"});
  EXPECT_EQ(places("core/a.cc", kLicence + "using namespace std;\n"), Places{});
}

TEST(Rooms, AHeaderIsReadOnce) { EXPECT_EQ(places("core/a.h", kLicence + "int a();\n"), Places{"core/a.h:1"}); }

TEST(Rooms, EverySourceFileBeginsWithItsLicence) {
  for (const std::string path : {"core/a.cc", "core/CMakeLists.txt", "protocol/a.proto", "deploy/scenes/a.toml"}) {
    EXPECT_EQ(places(path, "\n"), Places{path + ":1"});
  }
  EXPECT_EQ(places("deploy/run", "#!/bin/sh\necho\n"), Places{"deploy/run:2"});
  EXPECT_EQ(places("deploy/run", "#!/bin/sh\n# SPDX-License-Identifier: Apache-2.0\n"), Places{});
  EXPECT_EQ(places("core/CMakeLists.txt", "# SPDX-License-Identifier: Apache-2.0\n"), Places{});
  EXPECT_EQ(places("core/CMakeLists.txt", kLicence), Places{"core/CMakeLists.txt:1"});
}

TEST(Rooms, CommentsAndStringsBreakNoRule) {
  EXPECT_EQ(places("core/a.cc", kLicence + R"delimiter(
// std::shared_ptr, Clock::now(), #include <thread>
/* #include <mutex>
   #include "server/z.h" */
const char* a = "std::shared_ptr \" Clock::now()";
const char* z = R"(
#include <thread>
)";
constexpr int kMany = 1'000'000;
constexpr char kQuote = '"';
)delimiter"),
            Places{});
}

TEST(Rooms, WhatFollowsACommentOrAStringIsStillRead) {
  EXPECT_EQ(places("core/a.cc", kLicence + R"delimiter(
/* a */ std::shared_ptr<int> a;
auto b = '"'; std::shared_ptr<int> c;
auto d = 1'000; std::shared_ptr<int> e;
auto f = "\\"; std::shared_ptr<int> g;
auto h = R"x( )" )x"; std::shared_ptr<int> z;
)delimiter"),
            (Places{"core/a.cc:3", "core/a.cc:4", "core/a.cc:5", "core/a.cc:6", "core/a.cc:7"}));
}

TEST(Rooms, ACitedFileExists) {
  EXPECT_EQ(places("core/a.cc", kLicence + "// See core/gone.h and\n/* proofs.md. */ int a;  ///< lost.md\n"),
            (Places{"core/a.cc:2", "core/a.cc:3", "core/a.cc:3"}));
  EXPECT_EQ(places("core/CMakeLists.txt", "# SPDX-License-Identifier: Apache-2.0\nset(a b)  # core/gone.md\n"),
            Places{"core/CMakeLists.txt:2"});
  EXPECT_EQ(places("core/notes.md", "[old](gone.md#part)\n[new](../core/README.md), README.md, core/notes.md.\n"),
            Places{"core/notes.md:1"});
}

TEST(Rooms, ACitationIsOfThisTree) {
  EXPECT_EQ(
      places("core/a.cc", kLicence + "// https://example.org/gone.md, /usr/gone.md, *.md, core/*.h, sys/gone.h\n"),
      Places{});
  EXPECT_EQ(places("core/a.cc", kLicence + "const char* a = \"core/gone.md\";\n"), Places{});
  EXPECT_EQ(places("core/notes.md", "`core/x.h`, `core/x_test.cc` and a file pair in core\n"), Places{});
  EXPECT_EQ(check({{"CHANGELOG.md", "gone.md"}}), std::vector<Finding>{});
}

TEST(Rooms, ACitedSectionOfTheProofsExists) {
  const auto findings = [](const std::string& comment) {
    std::vector<std::string> lines;
    for (const auto& finding : check({{"core/PROOFS.md", "# Proofs\n\n## 1. Output bound\n\n## 2. Late holds\n"},
                                      {"core/README.md", ""},
                                      {"core/a.cc", kLicence + comment}})) {
      lines.push_back(to_string(finding));
    }
    return lines;
  };
  EXPECT_EQ(findings("// core/PROOFS.md, \"Output bound\" and \"Late\n// holds\". core/PROOFS.md has \"more\".\n"),
            Places{});
  EXPECT_EQ(findings("//\n/// core/PROOFS.md, \"Early holds\": never\n"),
            Places{"core/a.cc:3: core/PROOFS.md has no section \"Early holds\""});
  EXPECT_EQ(findings("// core/PROOFS.md,\n// \"Output bound\" and \"Bound\"\n"),
            Places{"core/a.cc:2: core/PROOFS.md has no section \"Bound\""});
}

TEST(Rooms, EveryRoomHasItsPage) {
  const auto findings = check({{"core/a.cc", kLicence}});
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(to_string(findings[0]), "core/README.md:1: the room core has no README.md");
}

TEST(Rooms, TheRootHoldsNothingElse) {
  const auto findings = check({{"notes.txt", ""}, {"scripts/a.txt", ""}, {"LICENSE", ""}});
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(to_string(findings[0]), "notes.txt:1: notes.txt has no place at the root");
  EXPECT_EQ(to_string(findings[1]), "scripts/a.txt:1: scripts has no place at the root");
}

TEST(Rooms, EveryFileOfThisTreeKeepsTheRules) {
  const auto tree = read_tree(TENDON_SOURCE_DIR);
  for (const std::string_view known : {"core/base/time.h", "protocol/wire/tendon.proto", "deploy/setup", ".ci/run"}) {
    ASSERT_NE(std::ranges::find(tree, known, &File::path), tree.end()) << known << " was not read";
  }
  for (const auto& finding : check(tree)) {
    ADD_FAILURE() << to_string(finding);
  }
}

}  // namespace
}  // namespace tendon::rooms::rooms_test
