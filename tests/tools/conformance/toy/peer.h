// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "tests/tools/conformance/opening.h"
#include "tests/tools/conformance/wire.h"

// Minimal conforming peers, and faults that break one rule each, for testing the kit in virtual time without sockets.

namespace tendon::conformance {

enum class Fault : std::uint8_t {
  kNone,
  kWrongVersion,
  kSkipsNumbers,
  kTimeGoesBack,
  kEchoOfTheLast,
  kEchoTimeIsNow,
  kEmptyMask,
  kNoKeepAlive,
  kTakesForeignHeaders,
  kTakesMalformed,
  kTakesForged,
  kDamagedUsesNumber,
  kTakesReplays,
  kDropsTheLate,
  kLongWindow,
  kShortWindow,
  kDropsTheUnknown,
  kTakesAnyValue,
  kOlderWins,
  kDoesNotFollowRekey,
  kNoOverlap,
  kOldKeyForEver,
  kNeverRenews,
  kTalksAfterBye,
  kOneBye,
  kNoTimeout,
  kAnythingIsALifeSign,
  kBodyIsNoMessage,
  kSilentToBadRequests,
  kKnowsNoAes,
  kLittleEndianNonce,  ///< in suite 2
  kLongRetry,
  kTwoRetries,
  kAnswersShortHellos,
  kTakesAnyHello,
  kOneCookieForAll,
  kBadWelcome,
  kInventsFeatures,
  kSecondSession,
  kLowestVersion,
  kWelcomesAnyVersion,
  kWelcomesPlain,
  kRefusesUnknownKeys,
  kStatesWhileHalfOpen,
  kTwoControllers,
  kWrongReplacedCode,
  kNoHelloLimit,
  kTicksGoBack,
  kAnswersStrays,
  kRoamsByAnything,
  kObserversPush,
  kObserversRearm,
  kObserversDisarm,
  kRequestsAsTheyCome,
  kRequestsAgain,
  kForgetsAnswers,
  kSilentToUnknownRequests,
  kTakesAnyRequestId,
  kGrantsUnasked,
  kGrantsBackwards,
  kGrantsAnything,
  kDescribesAnother,
  kDescribesAnyNumber,
  kAnybodyTakesTheLease,
  kDeniesTheHolder,
  kKeepsTheLease,
  kTakesAnyDeadband,
  kSendsThePredicted,
  kSilentWithDeadband,
  kDeadbandForEver,
  kTellsNothing,
  kReportsAllTheTime,
  kReportsOfOneNumber,
  kReportsBeyondBounds,
  kDiagnosesUnasked,
  kTellsOfTheHandleUnasked,
  kTellsTheOrientationUnasked,
  kColumnsUnasked,
  kNoColumns,
  kShortColumns,
  kCoarseColumns,
  kPositionsInSingle,
  kCouplesUnasked,
  kCouplesWhatDiffers,
  kDiffersWithoutAWord,
  kNeverCouples,
  kStatesWhileCoupled,
  kCoupledInSilence,
  kPortsBeyondBounds,
  kPortsOfOneSequence,
  kEngagesAFollower,
  kScalesAFollower,
  kSharesOneLeader,
  kSetsOutputsUnasked,
  kSetsAnyOutput,
  kKnowsNoChannels,  ///< this is an older server
  kKnowsNoCoupling,  ///< not a fault
  kKnowsNoColumns,   ///< not a fault
  kShortHello,
  kHelloWithConnection,
  kDirtyPadding,
  kCookieFromTheStart,
  kNoRole,
  kNineWays,
  kSlowHellos,
  kHelloChanges,
  kRandomStays,
  kIgnoresRetries,
  kPingPong,
  kTakesForeignRetry,
  kTakesForeignAnswer,
  kTakesAnyVersion,
  kTakesBadWelcome,
  kTakesPlainAnswer,
  kGoesOnWhenRefused,
  kSequenceStays,
  kValidForAnHour,
  kAnswersNoState,
  kSaysWaysUnasked,
  kTurnsUnasked,
  kObserverPushes,
  kRequestsFromTwo,
  kAsksOnce,
  kAsksAllTheTime,
  kAsksForEver,
};

/// A peer in this process. Port numbers replace addresses.
class ToyPeer {
 public:
  struct Outgoing {
    int port;
    Bytes datagram;
  };
  virtual ~ToyPeer() = default;
  virtual void receive(LocalTime now, int port, Span datagram) = 0;
  virtual void tick(LocalTime now) = 0;
  std::vector<Outgoing> take() { return std::exchange(out_, {}); }

 protected:
  void send(int port, Bytes datagram) { out_.push_back({port, std::move(datagram)}); }
  std::vector<Outgoing> out_;
};

}  // namespace tendon::conformance
