// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/tools/conformance/conversation.h"
#include "tests/tools/conformance/opening.h"
#include "tests/tools/conformance/report.h"
#include "tests/tools/conformance/wire.h"

namespace tendon::conformance {

inline constexpr Duration kSilence = std::chrono::milliseconds(250);

/// A correct client of the server under test. Each check uses its own ports.
struct ServerGuest {
  struct Session {
    pb::Welcome welcome;
    Attempt attempt;
    Sixteen cookie;
    Conversation talk;
  };

  Wire& wire;
  const Options& options;
  Report& report;

  Bytes32 random32();
  Attempt attempt(const pb::Hello& hello) { return attempt(bytes_of(hello), options.key); }
  Attempt attempt(Span hello, const std::optional<Key>& key);
  pb::Hello hello(pb::Role role) const;
  std::vector<Bytes> replies(int port, Duration patience);
  std::optional<Sixteen> cookie(int port, const Attempt& attempt);
  std::optional<Answered> ask(int port, const Attempt& attempt, const Sixteen& cookie);
  std::optional<Answered> ask(const pb::Hello& words);
  /// Judges "welcome" and "first-data".
  std::optional<Session> enter(pb::Role role) { return enter(hello(role)); }
  std::optional<Session> enter(const pb::Hello& words);
  Conversation::Setup setup(int port, const Answered& answered) const;
  void expect_silence(std::string_view check, int port, const std::string& after);
};

}  // namespace tendon::conformance
