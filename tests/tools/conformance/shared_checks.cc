// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/shared_checks.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/protocol/wire/raw_protobuf.h"
#include "tests/tools/conformance/request_bounds.h"

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;

constexpr Duration kMoment = milliseconds(150);

pb::Datagram of(const pb::Frame& frame) {
  pb::Datagram body;
  *body.add_frames() = frame;
  return body;
}

bool shows(Conversation& talk, Evidence& evidence, std::uint64_t number) {
  return !evidence.any || talk.listen_until(kPatience, [&] { return evidence.shown(number); });
}

std::string number_text(std::uint64_t number) { return "the state or force number " + std::to_string(number); }

Bytes with(Bytes bytes, std::size_t at, std::byte difference) {
  bytes[at] ^= difference;
  return bytes;
}

struct Bad {
  std::string_view check;
  std::string_view wrong;  ///< the error, for example "magic 0x55"
  std::function<Bytes(std::uint64_t number, const pb::Datagram& body)> make;
};

/// Datagrams with a valid body and, with a key, a valid seal; only the header is wrong.
std::vector<Bad> foreign_headers(Conversation& talk) {
  const auto changed = [&talk](auto change) {
    return [&talk, change](std::uint64_t number, const pb::Datagram& body) {
      Head head = talk.head(number);
      change(head);
      return talk.seal(head, bytes_of(body));
    };
  };
  return {{"foreign-header", "magic 0x55", changed([](Head& head) { head.magic = 0x55; })},
          {"foreign-header", "version 2", changed([](Head& head) { head.version = 2; })},
          {"foreign-header", "type 5", changed([](Head& head) { head.type = 5; })},
          {"foreign-header", "the other suite", changed([](Head& head) { head.suite = head.suite == 1 ? 0 : 1; })},
          {"foreign-header", "another connection id", changed([](Head& head) { head.connection_id ^= 0x80000000U; })},
          {"foreign-header", "1201 bytes", [&talk](std::uint64_t number, const pb::Datagram& body) {
             const std::size_t overhead = kHeadSize + (talk.setup().suite == 0 ? 0 : crypto::kTagSize);
             Bytes bytes = bytes_of(body);
             // An unknown field that fills it to 1201 bytes: 2 bytes of key, 2 of length.
             const std::string filling(kLargest + 1 - overhead - bytes.size() - 4, 'x');
             return talk.seal(talk.head(number), std::move(bytes) + RawProtobuf().text(99, filling).bytes());
           }}};
}

std::vector<Bad> malformed_bodies(Conversation& talk) {
  const auto more = [&talk](const RawProtobuf& tail) {
    return [&talk, tail](std::uint64_t number, const pb::Datagram& body) {
      return talk.seal(talk.head(number), bytes_of(body) + tail.bytes());
    };
  };
  const RawProtobuf latin1 = RawProtobuf().varint(1, 1).varint(2, 1).text(3, "caf\xe9");
  RawProtobuf many;
  for (int i = 0; i < 64; ++i) many.message(3, {});
  return {
      {"malformed-body", "a frame that ends too soon", more(RawProtobuf().text(3, "\x0a\x7f"))},
      {"malformed-body", "a text that is not UTF-8", more(RawProtobuf().message(3, RawProtobuf().message(4, latin1)))},
      {"malformed-body", "65 frames", more(many)},
      {"malformed-body", "a time beyond 2^60 ns", more(RawProtobuf().fixed64(1, (std::uint64_t{1} << 60) + 1))}};
}

std::vector<Bad> forgeries(Conversation& talk) {
  const auto good = [&talk](std::uint64_t number, const pb::Datagram& body) {
    return talk.seal(talk.head(number), bytes_of(body));
  };
  return {
      {"forged", "its last bit flipped",
       [good](std::uint64_t number, const pb::Datagram& body) {
         Bytes bytes = good(number, body);
         const std::size_t last = bytes.size() - 1;
         return with(std::move(bytes), last, std::byte{1});
       }},
      {"forged", "a bit of its body flipped",
       [good](std::uint64_t number, const pb::Datagram& body) {
         return with(good(number, body), kHeadSize, std::byte{0x80});
       }},
      {"forged", "the body of another number",
       [good](std::uint64_t number, const pb::Datagram& body) {
         return with(good(number ^ 1U, body), 8, std::byte{1});
       }},
      {"forged", "a body in the clear",
       [&talk](std::uint64_t number, const pb::Datagram& body) { return write(talk.head(number)) + bytes_of(body); }},
      {"forged", "a header and nothing else",
       [&talk](std::uint64_t number, const pb::Datagram&) { return write(talk.head(number)); }}};
}

/// The peer must not accept any of them. Returns the first packet number.
std::uint64_t say_all(Conversation& talk, Evidence& evidence, const std::vector<Bad>& all, bool numbers_stay_free) {
  const std::uint64_t first = talk.next_number();
  const std::uint64_t unseen = evidence.next;
  evidence.next += all.size() + 10;
  for (std::size_t i = 0; i < all.size(); ++i) {
    pb::Datagram body = of(evidence.frame(unseen + i));
    talk.stamp(body);
    talk.say_bad(all[i].check, first + i, all[i].make(first + i, body), all[i].wrong);
  }
  if (!numbers_stay_free) talk.overhear(kMoment);  // gives the peer time to echo the last of them
  // The ack vector contains the last 32 numbers, so it may contain numbers that are used.
  talk.skip_to(first + all.size() + (numbers_stay_free ? 0 : 40));
  const bool lives = talk.confirmed(talk.say());
  talk.listen(kMoment);
  for (std::size_t i = 0; i < all.size(); ++i) {
    talk.report().judge(all[i].check, lives, "no answer after wrong datagrams", "the session continues");
    talk.report().judge(all[i].check, !evidence.shown(unseen + i), number_text(unseen + i) + " was accepted",
                        "dropped, because its datagram had " + std::string(all[i].wrong));
  }
  return first;
}

}  // namespace

void check_bad_datagrams(Conversation& talk, Evidence& evidence) {
  const bool sealed = talk.setup().suite != 0;
  const std::uint64_t too_far = std::uint64_t{1} << 60;
  pb::Datagram body;
  talk.stamp(body);
  talk.say_bad("foreign-header", too_far, talk.seal(talk.head(too_far), bytes_of(body)), "packet number 2^60");
  talk.say_bytes(bytes_of("T\x13"));

  std::vector<Bad> all = foreign_headers(talk);
  std::ranges::move(sealed ? forgeries(talk) : malformed_bodies(talk), std::back_inserter(all));
  const std::uint64_t first = say_all(talk, evidence, all, true);
  if (talk.report().failed("reordering")) {
    talk.report().not_applicable("damaged-copy", "this peer drops late datagrams");
    talk.skip_to(talk.next_number() + 40);
  } else {
    for (std::size_t i = 0; i < all.size(); ++i) {
      talk.attribute(first + i, "damaged-copy");
      talk.say_at(first + i, {});
    }
    talk.report().judge("damaged-copy", talk.confirmed(talk.say()), "no echo", "an echo");
  }
  if (!sealed) return talk.report().not_applicable("forged", "suite 0 has no tag");
  // An authentic datagram uses its number regardless of the body.
  if (!evidence.any) return talk.report().not_applicable("malformed-body", "not visible for an encrypted observer");
  say_all(talk, evidence, malformed_bodies(talk), false);
}

void check_replay(Conversation& talk) {
  const std::uint64_t number = talk.next_number();
  talk.skip_to(number + 1);
  const Bytes bytes = talk.compose(number, {});
  talk.say_bytes(bytes);
  const bool heard = talk.confirmed(number);
  talk.will_repeat(number);
  for (int i = 0; i < 3; ++i) {
    talk.say_bytes(bytes);
    talk.overhear(milliseconds(60));
  }
  talk.report().judge("replay", heard && talk.confirmed(talk.say()), "no answer after a replay",
                      "the session continues");
}

void check_reordering(Conversation& talk, Evidence& evidence) {
  const std::uint64_t late = talk.next_number();
  talk.skip_to(late + 1);
  talk.confirmed(talk.say());
  const std::uint64_t shown = evidence.next++;
  talk.say_at(late, of(evidence.frame(shown)));
  talk.attribute(late, "reordering");
  talk.confirmed(talk.say());
  talk.report().judge("reordering", shows(talk, evidence, shown), number_text(shown) + " was not accepted",
                      "accepted, because it is the newest, although its datagram arrived late");
}

void check_window(Conversation& talk, Evidence& evidence) {
  if (!evidence.any) return talk.report().not_applicable("window-edge", "not visible for an observer");
  if (talk.report().failed("reordering")) {
    return talk.report().not_applicable("window-edge", "this peer drops late datagrams");
  }
  talk.skip_to(talk.next_number() + 3000);
  talk.confirmed(talk.say());
  // No keep-alives until both are sent, because they would advance the window.
  const std::uint64_t edge = talk.next_number() - 1 - 1984;
  const std::uint64_t too_old = evidence.next++;
  const std::uint64_t just_in_time = evidence.next++;
  pb::Datagram body = of(evidence.frame(too_old));
  talk.stamp(body);
  talk.say_bad("window-edge", edge, talk.seal(talk.head(edge), bytes_of(body)), "a number 1984 behind the newest");
  talk.overhear(kMoment);
  talk.say_at(edge + 1, of(evidence.frame(just_in_time)));
  const bool shown = shows(talk, evidence, just_in_time);
  talk.report().judge("window-edge", !evidence.shown(too_old), number_text(too_old) + " was accepted",
                      "dropped, because its packet is 1984 numbers behind the newest");
  talk.report().judge("window-edge", shown, number_text(just_in_time) + " was not accepted",
                      "accepted, because its packet is 1983 numbers behind the newest");
}

void check_unknown(Conversation& talk, Evidence& evidence) {
  const std::uint64_t number = evidence.next++;
  pb::Frame known = evidence.frame(number);
  known.GetReflection()->MutableUnknownFields(&known)->AddVarint(1000, 7);
  pb::Datagram body;
  pb::Frame& unknown = *body.add_frames();
  unknown.GetReflection()->MutableUnknownFields(&unknown)->AddLengthDelimited(500, "of version 2");
  *body.add_frames() = known;
  body.GetReflection()->MutableUnknownFields(&body)->AddFixed64(1001, 7);
  talk.attribute(talk.next_number(), "unknown-ignored");
  const bool heard = talk.confirmed(talk.say(body));
  talk.report().judge("unknown-ignored", heard, "no echo of a datagram with an unknown frame and field", "an echo");
  talk.report().judge("unknown-ignored", shows(talk, evidence, number), number_text(number) + " was not accepted",
                      "accepted, because only other parts are unknown");
}

void check_out_of_bounds(Conversation& talk, Evidence& evidence,
                         const std::vector<std::function<void(pb::Frame&)>>& damages) {
  std::vector<std::uint64_t> bad;
  for (const auto& damage : damages) {
    // Each also contains a valid frame with a lower number, so that the invalid one would win if it were accepted.
    const std::uint64_t good = evidence.next++;
    bad.push_back(evidence.next);
    pb::Frame frame = evidence.frame(evidence.next);
    evidence.next += 2;
    damage(frame);
    pb::Datagram body = of(frame);
    *body.add_frames() = evidence.frame(good);
    const bool lives = talk.confirmed(talk.say(body));
    talk.report().judge("out-of-bounds", lives, "no echo after " + frame.ShortDebugString(), "the session continues");
    talk.report().judge("out-of-bounds", shows(talk, evidence, good), number_text(good) + " was not accepted",
                        "only the frame out of bounds is dropped, not the next one: " + frame.ShortDebugString());
    talk.report().judge("out-of-bounds", !evidence.shown(bad.back()), number_text(bad.back()) + " was accepted",
                        "dropped: " + frame.ShortDebugString());
  }
}

void check_bad_requests(Conversation& talk, std::uint32_t id) {
  for (BadRequest& bad : requests_out_of_bounds()) {
    bad.control.set_id(id++);
    const auto ack = talk.ask(bad.control);
    const std::string_view path = bad.field;
    const std::string_view name = path.substr(path.rfind('.') + 1);
    const bool named = ack && ack->code() == pb::CODE_INVALID && ack->detail().find(name) != std::string::npos;
    // An older peer does not know all of the requests.
    const bool unknown = ack && ack->code() == pb::CODE_UNSUPPORTED;
    talk.report().judge("request-invalid", named || unknown,
                        (ack ? ack->ShortDebugString() : "no answer") + " to " + bad.control.ShortDebugString(),
                        "CODE_INVALID, with \"" + std::string(name) + "\" in its detail");
    if (!ack) return;  // the others would not be answered either
  }
  pb::Control sound;
  sound.set_id(id);
  sound.mutable_disarm();
  talk.report().judge("request-invalid", talk.ask(sound).has_value(), "no answer to a disarm after these requests",
                      "one");
}

void check_newest_wins(Conversation& talk, Evidence& evidence) {
  if (!evidence.any) return talk.report().not_applicable("newest-wins", "not visible for an observer");
  const std::uint64_t older = evidence.next;
  const std::uint64_t newer = older + 5;
  evidence.next += 10;
  talk.say(of(evidence.frame(newer)));
  talk.report().judge("newest-wins", shows(talk, evidence, newer), number_text(newer) + " was not accepted",
                      "believed");
  talk.confirmed(talk.say(of(evidence.frame(older))));
  talk.listen(kMoment);
  talk.report().judge("newest-wins", !evidence.shown(older),
                      number_text(older) + " was accepted after " + number_text(newer), "dropped as stale");
}

void check_rekey(Conversation& talk) {
  if (talk.setup().suite == 0) {
    for (const std::string_view check : {"rekey-followed", "old-key-overlap", "old-key-over"}) {
      talk.report().not_applicable(check, "suite 0 has no keys");
    }
    return;
  }
  talk.renew_key();
  const LocalTime moved_on = talk.now();
  // Shorter than the peer's timeout.
  const bool followed = talk.confirmed(talk.say(), std::chrono::seconds(1));
  talk.report().judge("rekey-followed", followed, "no echo of a datagram of the next epoch", "an echo");
  if (!followed) {
    talk.return_to_old_key();
    for (const std::string_view check : {"old-key-overlap", "old-key-over"}) {
      talk.report().not_applicable(check, "the peer does not change to the next key");
    }
    return;
  }
  const std::uint64_t ahead = talk.next_number();
  talk.skip_to(ahead + 1);
  pb::Datagram body;
  talk.stamp(body);
  talk.say_bad("old-key-over", ahead, talk.seal(talk.head(ahead), bytes_of(body), 2), "a key after the next");

  const std::uint64_t old = talk.next_number();
  talk.skip_to(old + 1);
  if (talk.now() - moved_on > std::chrono::seconds(1)) {
    return talk.report().not_applicable("old-key-overlap", "this machine paused for too long");
  }
  talk.attribute(old, "old-key-overlap");
  talk.say_old(old);
  talk.report().judge("old-key-overlap", talk.confirmed(talk.say()), "no echo", "an echo");
}

void check_old_key(Conversation& talk, LocalTime renewed) {
  if (talk.setup().suite == 0) return;
  talk.listen(renewed + milliseconds(2300) - talk.now());
  if (talk.report().failed("rekey-followed")) return;
  const std::uint64_t old = talk.next_number();
  talk.skip_to(old + 1);
  pb::Datagram body;
  talk.stamp(body);
  talk.say_bad("old-key-over", old, talk.seal(talk.head(old), bytes_of(body), -1), "the old key");
  const bool lives = talk.confirmed(talk.say());
  talk.report().judge("old-key-over", lives && talk.told_of(old) == false,
                      "a datagram with an expired key was accepted",
                      "dropped, because the next epoch started more than 2 s ago");
}

void check_keep_alive(Conversation& talk) {
  const std::size_t before = talk.heard().size();
  talk.listen_until(
      milliseconds(1500), [&] { return talk.heard().size() - before >= 8; }, false);
  const std::size_t count = talk.heard().size() - before;
  talk.report().judge("keep-alive", count >= 8, std::to_string(count) + " datagrams in 1500 ms",
                      "30, one every 50 ms; at least 8");
}

void check_timeout(Conversation& talk, Duration timeout) {
  const std::uint64_t number = talk.next_number();
  talk.skip_to(number + 1);
  const Bytes last = talk.compose(number, {});
  talk.say_bytes(last);
  talk.will_repeat(number);
  const LocalTime fell_silent = talk.now();
  const std::size_t before = talk.heard().size();
  while (talk.now() - fell_silent < timeout + std::chrono::seconds(2)) {
    pb::Datagram body;
    talk.stamp(body);
    Head foreign = talk.head(number + 1);
    foreign.connection_id ^= 0x80000000U;
    talk.say_bytes(last);
    talk.say_bytes(talk.seal(foreign, bytes_of(body)));
    if (!talk.report().failed("malformed-body"))
      talk.say_bad("timeout", number + 2, talk.seal(talk.head(number + 2), bytes_of("\xff\xff")), "a malformed body");
    talk.overhear(milliseconds(100));
  }
  LocalTime heard_last = fell_silent;
  for (std::size_t i = before; i < talk.heard().size(); ++i) heard_last = talk.heard()[i].at;
  const auto ms = std::chrono::duration_cast<milliseconds>(heard_last - fell_silent);
  talk.report().judge("timeout", ms >= timeout / 2 && ms <= timeout + milliseconds(1500),
                      "datagrams for " + std::to_string(ms.count()) + " ms after our last valid datagram",
                      "for about " + std::to_string(timeout / milliseconds(1)) +
                          " ms, independent of replayed, malformed and foreign datagrams");
}

void check_bye_silence(Conversation& talk) {
  pb::Frame bye;
  bye.mutable_bye()->set_code(pb::CODE_OK);
  for (int i = 0; i < 3; ++i) talk.say(of(bye));
  talk.overhear(kMoment);
  const std::size_t before = talk.heard().size();
  talk.overhear(milliseconds(300));
  const std::size_t after = talk.heard().size() - before;
  talk.report().judge("bye-silence", after == 0, std::to_string(after) + " datagrams after our Bye", "none");
}

void check_byes(Conversation& talk, std::size_t since) {
  const auto is_bye = [](const pb::Frame& frame) { return frame.has_bye(); };
  talk.listen_until(
      kPatience, [&] { return talk.count_frames(since, is_bye) >= 3; }, false);
  talk.overhear(kMoment);
  std::size_t byes = 0;
  std::size_t after = 0;
  bool good = true;
  for (std::size_t i = since; i < talk.heard().size(); ++i) {
    const pb::Datagram& body = talk.heard()[i].body;
    if (body.frames_size() == 0 || !body.frames(0).has_bye()) {
      after += byes > 0 ? 1 : 0;
      continue;
    }
    ++byes;
    const pb::Bye& bye = body.frames(0).bye();
    good = good && body.frames_size() == 1 && bye.code() >= 1 && bye.code() <= 9 && bye.reason().size() <= 128;
  }
  talk.report().judge("bye-thrice", byes == 3, std::to_string(byes) + " datagrams with a Bye", "3");
  talk.report().judge("bye-thrice", after == 0, std::to_string(after) + " datagrams after the first Bye",
                      "none but Byes");
  talk.report().judge("bye-thrice", good, "a Bye with a code or reason out of bounds, or with other frames",
                      "code 1 … 9, a reason of at most 128 bytes, nothing else");
}

void check_rekey_sent(Conversation& talk, const Options& options) {
  if (!options.long_checks)
    return talk.report().not_applicable("rekey-sent", "requires --long, because it takes 610 s");
  if (talk.setup().suite == 0) return talk.report().not_applicable("rekey-sent", "suite 0 has no keys");
  const std::uint8_t before = talk.peer_epoch();
  const auto waited = options.key_age + std::chrono::seconds(10);
  const bool renewed = talk.listen_until(waited, [&] { return talk.peer_epoch() != before; });
  talk.report().judge("rekey-sent", renewed, "the same key for " + std::to_string(waited.count()) + " s",
                      "the next epoch after " + std::to_string(options.key_age.count()) + " s at the latest");
}

}  // namespace tendon::conformance
