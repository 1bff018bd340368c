// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/import_capture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/refusal.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector::import_capture_test {
namespace {

using std::chrono::milliseconds;

constexpr std::uint16_t kServer = 47100;
constexpr std::uint16_t kClient = 50000;
constexpr std::int64_t kBegin = 1'700'000'000'000'000'000;  // ns since 1970

std::string number(std::uint64_t value, int bytes, bool big = true) {
  std::string text;
  for (int i = 0; i < bytes; ++i) {
    const int shift = 8 * (big ? bytes - 1 - i : i);
    text += static_cast<char>(value >> shift & 0xFF);
  }
  return text;
}

struct Packet {
  std::int64_t at = 0;  ///< ns since 1970
  std::string bytes;
  std::size_t kept = std::string::npos;  ///< snapshot length
};

std::string udp(const std::string& payload, std::uint16_t source, std::uint16_t destination) {
  return number(source, 2) + number(destination, 2) + number(8 + payload.size(), 2) + number(0, 2) + payload;
}
std::string ip4(const std::string& body, int protocol = 17, unsigned fragment = 0) {
  return std::string("\x45\0", 2) + number(20 + body.size(), 2) + number(0, 2) + number(fragment, 2) + "\x40" +
         static_cast<char>(protocol) + std::string(10, '\0') + body;
}
std::string ip6(const std::string& body, int protocol = 17) {
  return std::string("\x60\0\0\0", 4) + number(body.size(), 2) + static_cast<char>(protocol) + "\x40" +
         std::string(32, '\1') + body;
}
std::string ethernet(const std::string& packet, int tags = 0) {
  std::string text(12, '\2');
  for (int i = 0; i < tags; ++i) text += std::string("\x81\0\0\7", 4);
  return text + std::string("\x08\0", 2) + packet;
}
std::string echo(bool reply, unsigned id, unsigned sequence) {
  return ip4(std::string(1, static_cast<char>(reply ? 0 : 8)) + std::string(3, '\0') + number(id, 2) +
                 number(sequence, 2) + std::string(56, 'x'),
             1);
}

std::string pcap(const std::vector<Packet>& packets, std::uint32_t link = 101, bool big = false,
                 bool nanoseconds = true) {
  const auto field = [big](std::uint64_t value, int bytes = 4) { return number(value, bytes, big); };
  std::string text = field(nanoseconds ? 0xA1B23C4D : 0xA1B2C3D4) + field(2, 2) + field(4, 2) + field(0) + field(0) +
                     field(262144) + field(link);
  for (const Packet& packet : packets) {
    const std::string kept = packet.bytes.substr(0, packet.kept);
    const auto at = static_cast<std::uint64_t>(packet.at);
    text += field(at / 1'000'000'000) + field(at % 1'000'000'000 / (nanoseconds ? 1 : 1000)) + field(kept.size()) +
            field(packet.bytes.size()) + kept;
  }
  return text;
}

std::string pcapng(const std::vector<Packet>& packets, std::uint32_t link, bool big, unsigned resolution) {
  const auto field = [big](std::uint64_t value, int bytes = 4) { return number(value, bytes, big); };
  const auto block = [&](std::uint32_t type, std::string body) {
    body.resize((body.size() + 3) / 4 * 4);
    return field(type) + field(body.size() + 12) + body + field(body.size() + 12);
  };
  std::string text = block(0x0A0D0D0A, field(0x1A2B3C4D) + field(1, 2) + field(0, 2) + std::string(8, '\xFF'));
  text += block(1, field(link, 2) + field(0, 2) + field(0) + field(9, 2) + field(1, 2) +
                       std::string(1, static_cast<char>(resolution)) + std::string(3, '\0') + field(0));
  text += block(5, std::string(12, 'x'));  // statistics, which are skipped
  std::uint64_t rate = 1;
  for (unsigned i = 0; i < (resolution & 0x7F); ++i) rate *= (resolution & 0x80) != 0 ? 2 : 10;
  for (const Packet& packet : packets) {
    const auto ticks =
        static_cast<std::uint64_t>(packet.at) / 1'000'000'000 * rate +
        static_cast<std::uint64_t>(static_cast<double>(packet.at % 1'000'000'000) * static_cast<double>(rate) / 1e9);
    text += block(6, field(0) + field(ticks >> 32) + field(ticks & 0xFFFFFFFF) + field(packet.bytes.size()) +
                         field(packet.bytes.size()) + packet.bytes);
  }
  return text;
}

Capture capture(const std::string& bytes) {
  std::istringstream in(bytes);
  return read_capture(in, "t");
}
Tap tap(const char* name, const std::vector<Packet>& packets) { return {name, capture(pcap(packets))}; }

Packet up(std::int64_t at, const std::string& payload) { return {at, ip4(udp(payload, kClient, kServer))}; }
Packet down(std::int64_t at, const std::string& payload) { return {at, ip4(udp(payload, kServer, kClient))}; }
constexpr std::int64_t ms(double value) { return kBegin + static_cast<std::int64_t>(value * 1e6); }

TEST(Capture, ReadsEachFormatByteOrderAndLinkType) {
  const std::string datagram = udp("hello", 1, 2);
  const Packet raw{ms(0.5), ip4(datagram)};
  const std::vector<std::pair<std::string, std::string>> files = {
      {"pcap ns", pcap({raw})},
      {"pcap ns, big-endian", pcap({raw}, 101, true)},
      {"pcap µs", pcap({raw}, 101, false, false)},
      {"pcap µs, big-endian", pcap({raw}, 101, true, false)},
      {"null", pcap({{raw.at, number(2, 4) + raw.bytes}}, 0)},
      {"Ethernet", pcap({{raw.at, ethernet(raw.bytes)}}, 1)},
      {"Ethernet, two VLAN tags", pcap({{raw.at, ethernet(raw.bytes, 2)}}, 1)},
      {"Ethernet, padded", pcap({{raw.at, ethernet(raw.bytes) + std::string(10, '\0')}}, 1)},
      {"Linux cooked", pcap({{raw.at, std::string(16, '\0') + raw.bytes}}, 113)},
      {"Linux cooked 2", pcap({{raw.at, std::string(20, '\0') + raw.bytes}}, 276)},
      {"IPv6", pcap({{raw.at, ip6(datagram)}})},
      {"pcapng µs", pcapng({raw}, 101, false, 6)},
      {"pcapng ns, big-endian", pcapng({raw}, 101, true, 9)},
      {"pcapng 2⁻²⁰ s", pcapng({raw}, 101, false, 0x80 | 20)},
  };
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    const Capture read = capture(bytes);
    ASSERT_EQ(read.datagrams.size(), 1U);
    const CapturedDatagram& one = read.datagrams.front();
    EXPECT_NEAR(static_cast<double>((one.at - Duration(raw.at)).count()), 0, 1000);
    EXPECT_EQ(one.source, 1);
    EXPECT_EQ(one.destination, 2);
    EXPECT_EQ(one.size, 5U);
    EXPECT_FALSE(one.cut);
    EXPECT_EQ(one.payload_hash, payload_hash(std::as_bytes(std::span(std::string_view("hello")))));
    EXPECT_FALSE(read.truncated);
  }
}

TEST(Capture, CountsWhatItSkips) {
  const Capture read = capture(pcap({{ms(0), ip4(udp("a", 1, 2), 17, 0x2000)},
                                     {ms(1), ip4(std::string(20, 't'), 6)},
                                     {ms(2), ip4(std::string(20, 'x'), 47)},
                                     {ms(3), "\x45"},
                                     up(ms(4), "whole")}));
  EXPECT_EQ(read.fragments, 1U);
  EXPECT_EQ(read.tcp, 1U);
  EXPECT_EQ(read.others, 2U);
  EXPECT_EQ(read.datagrams.size(), 1U);
  EXPECT_EQ(read.first, Duration(ms(0)));
  EXPECT_EQ(read.last, Duration(ms(4)));
}

TEST(Capture, AFileThatEndsWithinAPacketGivesItsWholePackets) {
  const std::string whole = pcap({up(ms(0), "one"), up(ms(1), "two")});
  for (std::size_t less : {1U, 30U}) {
    const Capture read = capture(whole.substr(0, whole.size() - less));
    EXPECT_EQ(read.datagrams.size(), 1U) << less;
    EXPECT_TRUE(read.truncated) << less;
  }
  EXPECT_FALSE(capture(whole).truncated);
}

TEST(Capture, SaysWhatIsNoCapture) {
  const auto refused = [](const std::string& bytes) {
    return thrown_by<std::runtime_error>([&bytes] { capture(bytes); });
  };
  EXPECT_EQ(refused(""), "t: expected a capture (pcap or pcapng), found less than 4 bytes");
  EXPECT_EQ(refused("# tendon-trace 1"), "t: expected a capture (pcap or pcapng), found another file");
  EXPECT_EQ(refused(pcap({{ms(0), "x"}}, 147)), "t: expected a link type of 0, 1, 101, 113 or 276, found 147");
  EXPECT_EQ(refused(pcap({}) + std::string(8, '\0') + std::string(8, '\x7F')),
            "t: expected at most 262144 bytes for a packet at byte 40, found 2139062143");
}

TEST(TwoTaps, ADatagramIsDelayedLostOrCopied) {
  const Tap client =
      tap("client", {up(ms(0), "a"), up(ms(10), "b"), up(ms(20), "c"), down(ms(45), "x"), up(ms(60), "end")});
  const Tap server = tap("server", {up(ms(5), "a"), up(ms(26), "c"), up(ms(28), "c"), down(ms(30), "x"),
                                    up(ms(64), "end"), up(ms(90), "late")});
  const TwoTaps taps = import_two_taps(client, server, {.port = kServer});
  ASSERT_EQ(taps.trace.records.size(), 5U);
  const auto& records = taps.trace.records;
  EXPECT_EQ(records[0].release - records[0].arrival, milliseconds(5));
  EXPECT_EQ(records[1].verdict, Verdict::kDrop);
  EXPECT_EQ(records[1].arrival, LocalTime(milliseconds(10)));
  EXPECT_EQ(records[2].release - records[2].arrival, milliseconds(6));
  EXPECT_EQ(records[2].duplicate, LocalTime(milliseconds(28)));
  EXPECT_EQ(records[3].direction, Direction::kDown);
  EXPECT_EQ(records[3].arrival, LocalTime(milliseconds(30)));
  EXPECT_EQ(records[3].release, LocalTime(milliseconds(45)));
  EXPECT_EQ(records[4].index, 3U);
  EXPECT_EQ(taps.summary, "");
}

TEST(TwoTaps, WhatTheOtherTapDidNotCoverIsNotKnown) {
  const Tap client = tap("client", {up(ms(0), "before"), up(ms(10), "a"), up(ms(20), "b"), up(ms(30), "under way")});
  const Tap server = tap("server", {up(ms(18), "a"), up(ms(28), "b")});
  const TwoTaps taps = import_two_taps(client, server, {.port = kServer});
  EXPECT_EQ(taps.trace.records.size(), 2U);
  EXPECT_EQ(taps.summary, "up: 2 datagrams left out: the other capture does not cover their arrival\n");
}

TEST(TwoTaps, AnOffsetOfTheClocksIsRemoved) {
  const Tap client = tap("client", {up(ms(0), "a"), down(ms(45), "x")});
  const Tap server = tap("server", {up(ms(505), "a"), down(ms(530), "x")});
  EXPECT_NE(thrown_by<std::runtime_error>([&] {
              import_two_taps(client, server, {.port = kServer});
            }).find("1 of 2 delays are negative, down to -485ms: the clocks of the taps differ"),
            std::string::npos);
  const TwoTaps taps = import_two_taps(client, server, {.port = kServer, .clock_offset = milliseconds(500)});
  ASSERT_EQ(taps.trace.records.size(), 2U);
  EXPECT_EQ(taps.trace.records[0].release - taps.trace.records[0].arrival, milliseconds(5));
  EXPECT_EQ(taps.trace.records[1].release - taps.trace.records[1].arrival, milliseconds(15));
}

TEST(TwoTaps, AProxyCanTranslateThePort) {
  const Tap client = tap("client", {up(ms(0), "a")});
  const Tap server = tap("server", {{ms(5), ip4(udp("a", kClient, 47101))}});
  EXPECT_EQ(import_two_taps(client, server, {.port = kServer, .server_port = 47101}).trace.records.size(), 1U);
}

TEST(TwoTaps, RefusesCapturesFromWhichNothingFollows) {
  const Tap client = tap("client", {up(ms(0), "a"), up(ms(10), "b"), down(ms(30), "x")});
  const Tap server = tap("server", {up(ms(5), "a"), up(ms(15), "b"), down(ms(20), "x")});
  const auto refused = [](const Tap& one, const Tap& other, std::uint16_t port = kServer) {
    return thrown_by<std::runtime_error>([&] { import_two_taps(one, other, {.port = port}); });
  };
  EXPECT_EQ(refused(client, server), "");
  EXPECT_EQ(refused(server, client),
            "3 of 3 delays are negative, down to -10ms: expected the capture at the client first, then the one at the "
            "server, or --clock-offset-ms if the clocks of the taps differ");
  EXPECT_EQ(refused(client, server, 5004),
            "client: expected UDP datagrams from or to port 5004, found 3 datagrams of other ports and 0 TCP packets");
  EXPECT_NE(refused(client, tap("tunnel", {up(ms(5), "sealed"), up(ms(15), "too")}))
                .find("no payload of client is in tunnel"),
            std::string::npos);
  Tap cut = tap("cut", {{ms(0), ip4(udp("a long payload", kClient, kServer)), 30}});
  EXPECT_EQ(refused(cut, server),
            "cut: the snapshot length cuts 1 datagram, so that payloads cannot be matched; expected a capture with "
            "tcpdump -s 0");
  EXPECT_EQ(refused(tap("same", {up(ms(0), "a"), up(ms(1), "a"), up(ms(2), "b")}), server),
            "same: 1 of 3 datagrams repeat an earlier payload, expected at most 1 %, because equal payloads cannot be "
            "told apart");
  EXPECT_NE(refused(tap("web", {{ms(0), ip4(std::string(20, 't'), 6)}}), server)
                .find("1 TCP packet, whose delay includes retransmissions"),
            std::string::npos);
}

TEST(TwoTaps, FindsEachVerdictOfAnInjector) {
  constexpr int kDatagrams = 20'000;
  Injector injector(parse_profile("delay=normal(20ms,4ms) order=free loss=burst(5%,3) duplicate=1%"), 7, 0,
                    Direction::kUp, LocalTime(Duration(kBegin)));
  std::vector<Packet> sent;
  std::vector<Packet> arrived = {up(ms(-100), "the capture began earlier")};
  std::vector<Decision> truth;
  for (int i = 0; i < kDatagrams; ++i) {
    const std::string payload = "datagram " + std::to_string(i);
    const std::int64_t at = ms(i);
    const Decision decision = injector.decide({.arrival = LocalTime(Duration(at)), .size = 20});
    sent.push_back(up(at, payload));
    truth.push_back(decision);
    const auto arrive = [&](LocalTime when) { arrived.push_back(up(when.time_since_epoch().count(), payload)); };
    if (decision.verdict != Verdict::kDrop) arrive(decision.release);
    if (decision.duplicate) arrive(*decision.duplicate);
  }
  std::ranges::stable_sort(arrived, {}, &Packet::at);
  arrived.push_back(up(ms(kDatagrams + 1000), "the capture continued"));
  const TwoTaps taps = import_two_taps(tap("client", sent), tap("server", arrived), {.port = kServer});
  ASSERT_EQ(taps.trace.records.size(), truth.size());
  std::size_t lost = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const TraceRecord& record = taps.trace.records[i];
    const bool dropped = truth[i].verdict == Verdict::kDrop;
    lost += dropped ? 1 : 0;
    ASSERT_EQ(record.verdict == Verdict::kDrop, dropped) << i;
    ASSERT_EQ(record.duplicate.has_value(), truth[i].duplicate.has_value() && !dropped) << i;
    if (!dropped) {
      ASSERT_EQ(record.release - record.arrival, truth[i].release - truth[i].arrival) << i;
    }
  }
  EXPECT_GT(lost, 500U);
}

TEST(OneTap, PairsEchoesByIdAndSequence) {
  const Tap pings = tap("pings", {{ms(0), echo(false, 7, 1)},
                                  {ms(20), echo(true, 7, 1)},
                                  {ms(1000), echo(false, 7, 2)},
                                  {ms(2000), echo(false, 7, 3)},
                                  {ms(2005), echo(true, 8, 3)},
                                  {ms(2030), echo(true, 7, 3)},
                                  {ms(2031), echo(true, 7, 3)},
                                  {ms(3000), echo(false, 7, 4)}});
  const Trace trace = import_echoes(pings, {.share = Share::kUp});
  ASSERT_EQ(trace.records.size(), 3U);
  EXPECT_EQ(trace.records[0].release - trace.records[0].arrival, milliseconds(20));
  EXPECT_EQ(trace.records[1].verdict, Verdict::kDrop);
  EXPECT_EQ(trace.records[2].release - trace.records[2].arrival, milliseconds(30));
}

TEST(OneTap, RefusesAReplyThatIsEarlierThanItsRequest) {
  const Tap set = tap("set", {{ms(0), echo(false, 7, 0)}, {ms(30), echo(false, 7, 1)}, {ms(29), echo(true, 7, 1)}});
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { import_echoes(set, {}); }),
            "set: a reply is 1ms earlier than its request; expected a clock that is not set during the capture");
}

TEST(OneTap, AnAnswerWithoutDelayIsAnAnswer) {
  const Tap equal = tap("equal", {{ms(0), echo(false, 7, 0)}, {ms(1), echo(false, 7, 1)}, {ms(1), echo(true, 7, 1)}});
  EXPECT_EQ(import_echoes(equal, {.share = Share::kUp}).records.size(), 2U);
}

TEST(OneTap, SaysWhyOtherProtocolsHaveNoDelay) {
  const Tap rtp = tap("rtp", {up(ms(0), "audio"), {ms(1), ip4(std::string(20, 't'), 6)}});
  EXPECT_EQ(
      thrown_by<std::runtime_error>([&] { import_echoes(rtp, {}); }),
      "rtp: expected ICMP echo requests and replies at a single tap, found 0 requests, 1 UDP datagram and 1 TCP "
      "packet. UDP needs a second capture at the server. The acknowledgments of TCP are delayed, and RTP does not "
      "contain the delay of the network");
}

}  // namespace
}  // namespace tendon::injector::import_capture_test
