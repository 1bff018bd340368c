// SPDX-License-Identifier: Apache-2.0
// A toy that obeys all rules passes. A toy that violates one rule fails the check for that rule only.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/secrets/suites.h"
#include "tests/tools/conformance/client_checks.h"
#include "tests/tools/conformance/request_bounds.h"
#include "tests/tools/conformance/server_checks.h"
#include "tests/tools/conformance/toy/client.h"
#include "tests/tools/conformance/toy/server.h"
#include "tests/tools/conformance/toy/wire.h"

namespace tendon::conformance::kit_test {
namespace {

struct Broken {
  Fault fault;
  std::string_view check;
  int suites = 2;  ///< 0: detectable in suite 0 only; 1: with a key; 2: in all suites
};

int suites_here() { return contains(suites_of_this_machine(), Suite::kAesGcm) ? 3 : 2; }

std::optional<Key> key_of(int suite) {
  if (suite == 0) return std::nullopt;
  return Key(Bytes32{std::byte{1}, std::byte{2}, std::byte{3}});
}

std::string told(const Report& report) {
  std::string out;
  for (const Verdict& verdict : report.verdicts()) {
    const bool bad = verdict.outcome == Outcome::kFailed || verdict.outcome == Outcome::kUnreached;
    if (bad) out += text_of(verdict) + '\n';
  }
  return out;
}

std::set<std::string_view> failed(const Report& report) {
  std::set<std::string_view> out;
  for (const Verdict& verdict : report.verdicts()) {
    if (verdict.outcome == Outcome::kFailed) out.insert(verdict.check->name);
  }
  return out;
}

Report server_report(int suite, Fault fault, bool long_checks = false) {
  crypto::start();
  const Options options{.key = key_of(suite),
                        .aes = suite == 2,
                        .long_checks = long_checks || fault == Fault::kNeverRenews,
                        .key_age = ToySession::kKeyAge,
                        .follower = fault != Fault::kKnowsNoCoupling};
  ToyServer server(options.key, fault);
  ToyWire wire(server, true);
  Report report(Side::kServer);
  judge_server(wire, options, report);
  return report;
}

Report client_report(int suite, Fault fault, pb::Role role = pb::ROLE_CONTROLLER, bool long_checks = false) {
  crypto::start();
  const Options options{.key = key_of(suite),
                        .aes = suite == 2,
                        .long_checks = long_checks || fault == Fault::kNeverRenews,
                        .key_age = ToySession::kKeyAge};
  const bool asks = role == pb::ROLE_CONTROLLER;
  ToyClient client(options.key, role, asks, fault);
  ToyWire wire(client, false);
  Report report(Side::kClient);
  judge_client(wire, client, options, report);
  return report;
}

const std::vector<Broken>& of_either_end() {
  static const std::vector<Broken> kAll = {
      {Fault::kWrongVersion, "data-header"},
      {Fault::kSkipsNumbers, "packet-numbers"},
      {Fault::kTimeGoesBack, "tx-time"},
      {Fault::kEchoOfTheLast, "echo-newest"},
      {Fault::kEchoTimeIsNow, "echo-times"},
      {Fault::kEmptyMask, "echo-mask"},
      {Fault::kNoKeepAlive, "keep-alive"},
      {Fault::kTakesForeignHeaders, "foreign-header"},
      {Fault::kTakesMalformed, "malformed-body"},
      {Fault::kTakesForged, "forged", 1},
      {Fault::kDamagedUsesNumber, "damaged-copy"},
      {Fault::kTakesReplays, "replay"},
      {Fault::kDropsTheLate, "reordering"},
      {Fault::kLongWindow, "window-edge"},
      {Fault::kShortWindow, "window-edge"},
      {Fault::kDropsTheUnknown, "unknown-ignored"},
      {Fault::kTakesAnyValue, "out-of-bounds"},
      {Fault::kOlderWins, "newest-wins"},
      {Fault::kDoesNotFollowRekey, "rekey-followed", 1},
      {Fault::kNoOverlap, "old-key-overlap", 1},
      {Fault::kOldKeyForEver, "old-key-over", 1},
      {Fault::kNeverRenews, "rekey-sent", 1},
      {Fault::kTalksAfterBye, "bye-silence"},
      {Fault::kNoTimeout, "timeout"},
      {Fault::kAnythingIsALifeSign, "timeout"},
      {Fault::kSilentToBadRequests, "request-invalid"},
  };
  return kAll;
}

enum class Toy : std::uint8_t { kServer, kClient, kObserver };
struct Case {
  Toy toy;
  Broken broken;
};

class BrokenToy : public testing::TestWithParam<Case> {};

TEST_P(BrokenToy, FailsTheCheckOfTheRuleItBreaksAndNoOther) {
  const auto& [toy, broken] = GetParam();
  for (int suite = 0; suite < suites_here(); ++suite) {
    if (broken.suites != 2 && (broken.suites == 1) != (suite > 0)) continue;
    SCOPED_TRACE("suite " + std::to_string(suite));
    const Report report =
        toy == Toy::kServer
            ? server_report(suite, broken.fault)
            : client_report(suite, broken.fault, toy == Toy::kClient ? pb::ROLE_CONTROLLER : pb::ROLE_OBSERVER);
    EXPECT_EQ(failed(report), std::set{broken.check}) << told(report);
  }
}

TEST(Kit, SaysWhichForeignHeaderWasTaken) {
  const Report report = server_report(0, Fault::kTakesForeignHeaders);
  EXPECT_NE(told(report).find("dropped, because its datagram had "), std::string::npos) << told(report);
}

std::vector<Case> cases(Toy toy, const std::vector<Broken>& all) {
  std::vector<Case> out;
  for (const Broken& broken : all) out.push_back({toy, broken});
  return out;
}

std::string name_of(const testing::TestParamInfo<Case>& info) {
  std::string out;
  for (const char c : info.param.broken.check) out += c == '-' ? '_' : c;
  return out + "_" + std::to_string(info.index);
}

TEST(ConformanceKit, AServerThatKeepsAllRulesPasses) {
  for (int suite = 0; suite < suites_here(); ++suite) {
    const Report report = server_report(suite, Fault::kNone);
    EXPECT_TRUE(report.passed()) << "suite " << suite << "\n" << told(report);
  }
}

TEST(ConformanceKit, APeerThatRenewsItsKeyInTimePassesTheLongCheck) {
  const Report server = server_report(1, Fault::kNone, true);
  EXPECT_TRUE(server.passed()) << told(server);
  const Report client = client_report(1, Fault::kNone, pb::ROLE_CONTROLLER, true);
  EXPECT_TRUE(client.passed()) << told(client);
}

TEST(ConformanceKit, AServerThatKnowsNoChannelsPassesAndIsNotJudgedByThem) {
  for (int suite = 0; suite < suites_here(); ++suite) {
    const Report all = server_report(suite, Fault::kNone);
    const Report older = server_report(suite, Fault::kKnowsNoChannels);
    EXPECT_TRUE(older.passed()) << "suite " << suite << "\n" << told(older);
    EXPECT_EQ(older.count(Outcome::kNotApplicable), all.count(Outcome::kNotApplicable) + 9) << "suite " << suite;
  }
}

TEST(ConformanceKit, AServerThatKnowsNoCouplingPassesAndIsNotJudgedByIt) {
  for (int suite = 0; suite < suites_here(); ++suite) {
    const Report all = server_report(suite, Fault::kNone);
    const Report older = server_report(suite, Fault::kKnowsNoCoupling);
    EXPECT_TRUE(older.passed()) << "suite " << suite << "\n" << told(older);
    EXPECT_EQ(older.count(Outcome::kNotApplicable), all.count(Outcome::kNotApplicable) + 3) << "suite " << suite;
  }
}

TEST(ConformanceKit, AServerThatKnowsNoColumnsPassesAndIsNotJudgedByThem) {
  const Report all = server_report(0, Fault::kNone);
  const Report older = server_report(0, Fault::kKnowsNoColumns);
  EXPECT_TRUE(older.passed()) << told(older);
  EXPECT_EQ(older.count(Outcome::kNotApplicable), all.count(Outcome::kNotApplicable) + 1);
}

TEST(ConformanceKit, AClientThatKeepsAllRulesPasses) {
  for (int suite = 0; suite < suites_here(); ++suite) {
    for (const pb::Role role : {pb::ROLE_CONTROLLER, pb::ROLE_OBSERVER}) {
      const Report report = client_report(suite, Fault::kNone, role);
      EXPECT_TRUE(report.passed()) << "suite " << suite << ", role " << role << "\n" << told(report);
    }
  }
}

TEST(ConformanceKit, APeerThatDoesNotKnowSuite2PassesUnlessItIsAskedFor) {
  EXPECT_TRUE(server_report(1, Fault::kKnowsNoAes).passed());
  EXPECT_TRUE(client_report(1, Fault::kKnowsNoAes).passed());
  if (suites_here() < 3) GTEST_SKIP() << "this processor has no AES";
  EXPECT_EQ(failed(server_report(2, Fault::kKnowsNoAes)), std::set<std::string_view>{"suite-2"});
  EXPECT_EQ(failed(client_report(2, Fault::kKnowsNoAes)), std::set<std::string_view>{"suite-2"});
}

TEST(ConformanceKit, TellsANonceWithTheWrongEndInFront) {
  if (suites_here() < 3) GTEST_SKIP() << "this processor has no AES";
  EXPECT_TRUE(failed(server_report(2, Fault::kLittleEndianNonce)).contains("data-opens"));
  EXPECT_TRUE(failed(client_report(2, Fault::kLittleEndianNonce)).contains("data-opens"));
}

/// The vectors are generated from tendon.proto.
TEST(ConformanceKit, ItsBoundsOfRequestsAreThoseOfTheVectors) {
  std::ifstream file(std::string(TENDON_SOURCE) + "/protocol/vectors/bounds.json");
  static const std::regex kVector(R"re(.*"field": "(\w+)\.([^"]*)".*"accepted": (true|false), "body": "(\w*)".*)re");
  int refused = 0;
  std::set<std::string> fields;
  for (std::string line; std::getline(file, line);) {
    std::smatch found;
    pb::Datagram body;
    if (!std::regex_match(line, found, kVector) || !read(from_hex(found[4].str()), body)) continue;
    if (body.frames_size() != 1 || !body.frames(0).has_control() || body.frames(0).control().id() == 0) continue;
    const pb::Control& control = body.frames(0).control();
    if (control.has_offer_field() || control.has_use_field() || control.has_drop_field()) continue;  // not in the kit
    const std::string field = found[2].str().starts_with("rotation") ? "rotation" : found[2].str();
    EXPECT_EQ(field_out_of_bounds(control), found[3] == "true" ? "" : field) << line;
    if (found[3] == "false") fields.insert(found[1].str() + "." + field);
    refused += found[3] == "false" ? 1 : 0;
  }
  EXPECT_GT(refused, 150);
  std::set<std::string> said;
  for (const BadRequest& bad : requests_out_of_bounds()) {
    EXPECT_EQ(field_out_of_bounds(bad.control), bad.field) << bad.control.ShortDebugString();
    const auto& op = *bad.control.GetReflection()->GetOneofFieldDescriptor(
        bad.control, bad.control.GetDescriptor()->FindOneofByName("op"));
    said.insert(op.message_type()->name() + "." + bad.field);
  }
  for (const std::string& field : fields) EXPECT_TRUE(said.contains(field)) << "no bad request has a bad " << field;
}

INSTANTIATE_TEST_SUITE_P(ServerData, BrokenToy, testing::ValuesIn(cases(Toy::kServer, of_either_end())), name_of);
INSTANTIATE_TEST_SUITE_P(ClientData, BrokenToy, testing::ValuesIn(cases(Toy::kClient, of_either_end())), name_of);
INSTANTIATE_TEST_SUITE_P(Server, BrokenToy,
                         testing::ValuesIn(cases(Toy::kServer,
                                                 {
                                                     {Fault::kBodyIsNoMessage, "data-body"},
                                                     {Fault::kLongRetry, "retry"},
                                                     {Fault::kTwoRetries, "retry-once"},
                                                     {Fault::kAnswersShortHellos, "bad-hello-silence"},
                                                     {Fault::kTakesAnyHello, "bad-body-silence"},
                                                     {Fault::kOneCookieForAll, "cookie-bound"},
                                                     {Fault::kBadWelcome, "welcome"},
                                                     {Fault::kInventsFeatures, "features"},
                                                     {Fault::kSecondSession, "answer-again"},
                                                     {Fault::kLowestVersion, "version-highest"},
                                                     {Fault::kWelcomesAnyVersion, "version-mismatch"},
                                                     {Fault::kWelcomesPlain, "plain-denied", 1},
                                                     {Fault::kRefusesUnknownKeys, "unknown-key-silence", 1},
                                                     {Fault::kStatesWhileHalfOpen, "half-open"},
                                                     {Fault::kTwoControllers, "one-controller", 0},
                                                     {Fault::kWrongReplacedCode, "replaced", 1},
                                                     {Fault::kOneBye, "bye-thrice", 1},
                                                     {Fault::kNoHelloLimit, "hello-limit"},
                                                     {Fault::kTicksGoBack, "states"},
                                                     {Fault::kAnswersStrays, "stray-data-silence"},
                                                     {Fault::kRoamsByAnything, "roaming"},
                                                     {Fault::kObserversPush, "observer-only-looks"},
                                                     {Fault::kObserversRearm, "rearm-by-controller"},
                                                     {Fault::kObserversDisarm, "disarm-by-controller"},
                                                     {Fault::kRequestsAsTheyCome, "request-order"},
                                                     {Fault::kRequestsAgain, "request-once"},
                                                     {Fault::kForgetsAnswers, "answer-kept"},
                                                     {Fault::kSilentToUnknownRequests, "request-unknown"},
                                                     {Fault::kTakesAnyRequestId, "request-bounds"},
                                                     {Fault::kGrantsUnasked, "claims-granted"},
                                                     {Fault::kGrantsBackwards, "claims-granted"},
                                                     {Fault::kGrantsAnything, "claim-refused"},
                                                     {Fault::kDescribesAnother, "describe"},
                                                     {Fault::kDescribesAnyNumber, "describe-unknown"},
                                                     {Fault::kAnybodyTakesTheLease, "lease-denied"},
                                                     {Fault::kDeniesTheHolder, "lease-kept"},
                                                     {Fault::kKeepsTheLease, "lease-kept"},
                                                     {Fault::kTakesAnyDeadband, "deadband-bounds"},
                                                     {Fault::kSendsThePredicted, "deadband"},
                                                     {Fault::kSilentWithDeadband, "deadband"},
                                                     {Fault::kDeadbandForEver, "deadband"},
                                                     {Fault::kTellsNothing, "link-report"},
                                                     {Fault::kReportsAllTheTime, "link-report"},
                                                     {Fault::kReportsOfOneNumber, "link-report"},
                                                     {Fault::kReportsBeyondBounds, "link-report"},
                                                     {Fault::kDiagnosesUnasked, "diagnostics-unasked"},
                                                     {Fault::kTellsOfTheHandleUnasked, "handle-unasked"},
                                                     {Fault::kTellsTheOrientationUnasked, "handle-unasked"},
                                                     {Fault::kColumnsUnasked, "columns-unasked"},
                                                     {Fault::kNoColumns, "columns"},
                                                     {Fault::kShortColumns, "columns"},
                                                     {Fault::kCoarseColumns, "columns"},
                                                     {Fault::kPositionsInSingle, "columns"},
                                                     {Fault::kCouplesUnasked, "couple-unasked"},
                                                     {Fault::kCouplesWhatDiffers, "couple-differs"},
                                                     {Fault::kDiffersWithoutAWord, "couple-differs"},
                                                     {Fault::kNeverCouples, "couple"},
                                                     {Fault::kStatesWhileCoupled, "couple"},
                                                     {Fault::kCoupledInSilence, "couple"},
                                                     {Fault::kPortsBeyondBounds, "couple"},
                                                     {Fault::kPortsOfOneSequence, "couple"},
                                                     {Fault::kEngagesAFollower, "engage-at-leader"},
                                                     {Fault::kScalesAFollower, "scale-at-leader"},
                                                     {Fault::kSharesOneLeader, "share-of-several"},
                                                     {Fault::kSetsOutputsUnasked, "output-unasked"},
                                                     {Fault::kSetsAnyOutput, "output-unknown"},
                                                 })),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Client, BrokenToy,
                         testing::ValuesIn(cases(Toy::kClient,
                                                 {
                                                     {Fault::kShortHello, "hello-size"},
                                                     {Fault::kHelloWithConnection, "hello-header"},
                                                     {Fault::kDirtyPadding, "hello-padding"},
                                                     {Fault::kCookieFromTheStart, "hello-first-cookie"},
                                                     {Fault::kNoRole, "hello-body"},
                                                     {Fault::kNineWays, "hello-body"},
                                                     {Fault::kSlowHellos, "hello-repeated"},
                                                     {Fault::kHelloChanges, "hello-unchanged", 0},
                                                     {Fault::kRandomStays, "hello-new-random"},
                                                     {Fault::kIgnoresRetries, "cookie-returned"},
                                                     {Fault::kPingPong, "retry-no-ping-pong"},
                                                     {Fault::kTakesForeignRetry, "foreign-retry"},
                                                     {Fault::kTakesForeignAnswer, "foreign-answer", 0},
                                                     {Fault::kTakesAnyVersion, "version-not-offered"},
                                                     {Fault::kTakesBadWelcome, "bad-answer"},
                                                     {Fault::kTakesPlainAnswer, "plain-answer", 1},
                                                     {Fault::kGoesOnWhenRefused, "refused"},
                                                     {Fault::kOneBye, "bye-thrice"},
                                                     {Fault::kSequenceStays, "forces"},
                                                     {Fault::kValidForAnHour, "force-bounds"},
                                                     {Fault::kAnswersNoState, "force-answers"},
                                                     {Fault::kSaysWaysUnasked, "force-granted"},
                                                     {Fault::kTurnsUnasked, "force-granted"},
                                                     {Fault::kRequestsFromTwo, "request-numbers"},
                                                     {Fault::kAsksOnce, "request-repeated"},
                                                     {Fault::kAsksAllTheTime, "request-resend-rate"},
                                                     {Fault::kAsksForEver, "request-stops"},
                                                 })),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Observer, BrokenToy,
                         testing::ValuesIn(cases(Toy::kObserver, {{Fault::kObserverPushes, "observer-sends-none"}})),
                         name_of);

}  // namespace
}  // namespace tendon::conformance::kit_test
