// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "clients/cpp/discovery/discovery.h"
#include "tests/clients/cpp/discovery/fake_dns.h"
#include "tests/support/refusal.h"

namespace tendon::dns_sd::unicast_test {
namespace {

using testing::FakeDns;
using namespace testing::dns;

const Instance kFalcon{"falcon v1.2", "example.org"};
const std::string kText =
    "\x03v=1\x0D"
    "device=falcon\x07"
    "hz=1000";

std::string sound(const Question& question, bool /*tcp*/) {
  if (question.type == kSrv) return answer(question, {srv(0, 0, 47100, name("localhost"))});
  if (question.type == kTxt) return answer(question, {record(kTxt, kText)});
  return answer(question, {record(kPtr, name("falcon v1.2/_tendon/_udp/example/org"))});
}

std::string problem_with(FakeDns::Answer answers) {
  const FakeDns server(std::move(answers));
  return thrown_by<std::runtime_error>([&] { resolve_by_dns(kFalcon, server.address()); });
}

TEST(UnicastDiscovery, FindsHostPortAndText) {
  std::string asked;
  std::vector<Found> found;
  {
    const FakeDns server([&](const Question& question, bool tcp) {
      if (question.type == kSrv) asked = question.bytes;
      return sound(question, tcp);
    });
    found = resolve_by_dns(kFalcon, server.address());
  }  // joins the server's thread, which writes the recorded questions
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].host, "localhost");
  EXPECT_EQ(found[0].port, 47100);
  EXPECT_EQ(found[0].about, (About{.version = 1, .device = "falcon", .hz = 1000}));
  EXPECT_EQ(asked, name("falcon v1.2/_tendon/_udp/example/org") + two(kSrv) + two(1)) << "a dot is in the name";
}

TEST(UnicastDiscovery, PrefersTheLowestPriorityAndThenTheHeaviest) {
  const FakeDns server([](const Question& question, bool) {
    if (question.type == kTxt) return answer(question, {}, 0x8180);
    return answer(question, {srv(2, 9, 1, name("c")), srv(1, 1, 2, name("b")), srv(1, 5, 3, name("a")),
                             srv(0, 0, 4, name("")), srv(0, 0, 5, name("not a host"))});
  });
  const std::vector<Found> found = resolve_by_dns(kFalcon, server.address());
  ASSERT_EQ(found.size(), 3U) << "the root means: not here";
  EXPECT_EQ(found[0].host, "a");
  EXPECT_EQ(found[1].host, "b");
  EXPECT_EQ(found[2].host, "c");
}

TEST(UnicastDiscovery, ListsADomain) {
  const FakeDns server([](const Question& question, bool tcp) {
    if (question.type != kPtr) return sound(question, tcp);
    return answer(question, {record(kPtr, name("stylus/_tendon/_udp/example/org")),
                             record(kPtr, name("falcon v1.2/_tendon/_udp/Example/org")),
                             record(kPtr, name("printer/_ipp/_tcp/example/org")), record(kPtr, name("a\nb")),
                             record(kPtr, name("elsewhere/_tendon/_udp/example/com"))});
  });
  const std::vector<Found> found = browse_by_dns("example.org", server.address());
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].instance, kFalcon);
  EXPECT_EQ(found[0].about.device, "falcon");
  EXPECT_EQ(found[1].instance, (Instance{"stylus", "example.org"}));
}

TEST(UnicastDiscovery, ACutAnswerIsAskedForAgainByTcp) {
  const FakeDns server(
      [](const Question& question, bool tcp) { return tcp ? sound(question, tcp) : answer(question, {}, 0x8380); });
  EXPECT_EQ(resolve_by_dns(kFalcon, server.address()).at(0).host, "localhost");
}

TEST(UnicastDiscovery, ANameThatIsNotThereIsSaidAndWhereToLook) {
  EXPECT_EQ(problem_with([](const Question& question, bool) { return answer(question, {}, 0x8183); }),
            "cannot find dns-sd:falcon v1\\.2.example.org: the name servers have no SRV record of falcon "
            "v1\\.2._tendon._udp.example.org. --server dns-sd:.example.org lists all devices");
  const FakeDns server([](const Question& question, bool) { return answer(question, {}, 0x8183); });
  EXPECT_TRUE(browse_by_dns("example.org", server.address()).empty());
}

TEST(UnicastDiscovery, SilenceEndsWithASentence) {
  EXPECT_EQ(problem_with([](const Question&, bool) { return ""; }),
            "cannot search for falcon v1\\.2._tendon._udp.example.org: no name server replies. Expected DNS-SD records "
            "in this domain, or HOST:PORT instead of a name");
}

TEST(UnicastDiscovery, AnAnswerToAnotherQuestionIsNone) {
  EXPECT_NE(problem_with([](const Question& question, bool tcp) {
              Question other = question;
              other.id[0] = static_cast<char>(other.id[0] ^ 1);
              return sound(other, tcp);
            }).find("no name server replies"),
            std::string::npos);
}

TEST(UnicastDiscovery, NamesThatPointAtEachOtherLeadNowhere) {
  // Points to itself, after a header, a question, 12 bytes of record header, and 6 bytes of data.
  const std::string problem = problem_with([](const Question& question, bool) {
    const auto here = static_cast<unsigned>(12 + question.bytes.size() + 12 + 6);
    return answer(question, {srv(0, 0, 47100, two(0xC000U | here))});
  });
  EXPECT_NE(problem.find("have no SRV record"), std::string::npos) << problem;
  const std::string ring = problem_with([](const Question& question, bool) {
    const auto here = static_cast<unsigned>(12 + question.bytes.size());
    return answer(question, {two(0xC000U | here) + two(kSrv) + two(1) + two(0) + two(60) + two(0)});
  });
  EXPECT_NE(ring, "");
}

TEST(UnicastDiscovery, AnAnswerThatEndsTooSoonIsRefused) {
  for (const std::uint16_t type : {kSrv, kTxt}) {
    // the whole question must be kept, otherwise the resolver ignores the answer
    for (std::size_t lost = 1; lost < 22; lost += 4) {
      const FakeDns server([&](const Question& question, bool tcp) {
        const std::string whole = sound(question, tcp);
        return question.type == type ? whole.substr(0, whole.size() - lost) : whole;
      });
      EXPECT_THROW(resolve_by_dns(kFalcon, server.address()), std::runtime_error) << type << ", " << lost;
    }
  }
}

}  // namespace
}  // namespace tendon::dns_sd::unicast_test
