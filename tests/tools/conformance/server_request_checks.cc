// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/server_request_checks.h"

#include <string>

#include "tests/tools/conformance/golden.h"
#include "tests/tools/conformance/shared_checks.h"

namespace tendon::conformance {

using std::chrono::milliseconds;

void check_requests(ServerGuest& guest, Conversation& talk) {
  const auto rate = [](std::uint32_t id, std::uint32_t hz) {
    pb::Control control;
    control.set_id(id);
    control.mutable_set_state_rate()->set_hz(hz);
    return control;
  };
  const auto say = [&](const pb::Control& control) {
    pb::Datagram body;
    *body.add_frames()->mutable_control() = control;
    return talk.say(body);
  };
  const auto acks = [&](std::size_t since, std::uint32_t id) {
    return talk.count_frames(
        since, [id](const pb::Frame& frame) { return frame.has_control_ack() && frame.control_ack().id() == id; });
  };
  const auto states_in = [&](Duration window) {
    talk.confirmed(talk.say());
    const std::size_t before = talk.heard().size();
    talk.listen(window);
    return talk.count_frames(before, [](const pb::Frame& frame) { return frame.has_state(); });
  };
  constexpr Duration kWindow = milliseconds(600);
  constexpr std::size_t kBetween = 120;  // threshold of states in the window: 30 at 50 Hz, 300 at 500 Hz

  std::size_t before = talk.heard().size();
  talk.confirmed(say(rate(2, 50)));
  talk.listen(milliseconds(120));
  guest.report.judge("request-order", acks(before, 2) == 0, "request 2 was answered before request 1 was sent",
                     "no answer to 2 before 1");
  const auto first = talk.ask(rate(1, 500));
  const bool second = acks(before, 2) > 0 || talk.ask(rate(2, 50)).has_value();
  guest.report.judge("request-order", first && second, "no answer", "answers to 1 and 2");
  guest.report.judge("request-order", states_in(kWindow) < kBetween,
                     "more than " + std::to_string(kBetween) + " states in 600 ms",
                     "about 30, because request 2 with 50 per second was delivered last");

  const auto again = talk.ask(rate(1, 500));
  guest.report.judge("answer-kept",
                     again && first && again->code() == first->code() && again->detail() == first->detail(),
                     again ? again->ShortDebugString() : "nothing", first ? first->ShortDebugString() : "an answer");
  if (guest.report.failed("request-order")) {
    guest.report.not_applicable("request-once", "the last delivered request is unknown, because the order is wrong");
  } else {
    guest.report.judge("request-once", states_in(kWindow) < kBetween,
                       "more than " + std::to_string(kBetween) + " states in 600 ms after request 1 was repeated",
                       "about 30, because request 1 with 500 per second is delivered once");
  }

  pb::Control unknown;
  unknown.set_id(3);
  unknown.GetReflection()->MutableUnknownFields(&unknown)->AddLengthDelimited(1000, "");
  const auto refused = talk.ask(unknown);
  guest.report.judge("request-unknown", refused && refused->code() == pb::CODE_UNSUPPORTED,
                     refused ? refused->ShortDebugString() : "nothing", "CODE_UNSUPPORTED");

  // Sixteen requests in reverse order, without receiving the first answers; 7 is that of golden.md.
  before = talk.heard().size();
  for (std::uint32_t id = 19; id >= 4; --id) {
    pb::Datagram body;
    if (id == 7) {
      guest.report.judge("golden-frame", read(from_hex(golden::kControl), *body.add_frames()), "unreadable", "a frame");
    } else {
      *body.add_frames()->mutable_control() = rate(id, 50);
    }
    talk.say(body);
  }
  const auto all_of = [&](std::size_t since) {
    for (std::uint32_t id = 4; id <= 19; ++id) {
      if (acks(since, id) == 0) return false;
    }
    return true;
  };
  const bool all = talk.listen_until(kPatience, [&] { return all_of(before); });
  guest.report.judge("request-order", all, "not all of 4 … 19 were answered", "all, in any order");
  guest.report.judge("golden-frame", acks(before, 7) > 0, "no answer to " + std::string(golden::kControl),
                     "an answer to 7");
  before = talk.heard().size();
  pb::Datagram sixteen_again;
  for (std::uint32_t id = 4; id <= 19; ++id) *sixteen_again.add_frames()->mutable_control() = rate(id, 50);
  talk.say(sixteen_again);
  guest.report.judge("answer-kept", talk.listen_until(kPatience, [&] { return all_of(before); }),
                     "not all of 4 … 19 were answered again", "the last 16 answers are kept");

  before = talk.heard().size();
  say(rate(0, 50));
  talk.confirmed(say(rate(20 + 16, 50)));
  talk.listen(milliseconds(120));
  guest.report.judge("request-bounds", acks(before, 0) == 0 && acks(before, 36) == 0, "an answer to request 0 or 36",
                     "dropped, because 0 is not an id, and 36 is more than 16 above 19, the last answered id");

  // One state per second, so the server must send keep-alives.
  guest.report.judge("request-order", talk.ask(rate(20, 1)).has_value(), "no answer to 20", "an answer");
  check_keep_alive(talk);
  talk.ask(rate(21, 1'000'000));
}

}  // namespace tendon::conformance
