// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/refusal.h"
#include "tests/tools/injector/injector.h"

namespace tendon::injector::trace_test {
namespace {

using namespace std::chrono_literals;

LocalTime at(Duration since_zero) { return LocalTime(since_zero); }

TraceRecord record_of(std::uint64_t index, std::uint64_t bits) {
  TraceRecord record;
  record.direction = (bits & 1) != 0 ? Direction::kDown : Direction::kUp;
  record.link = static_cast<std::uint32_t>(bits >> 1 & 3);
  record.index = index;
  record.arrival = at(Duration(index * 1'000'003));
  record.size = static_cast<std::uint32_t>(bits % 1201);
  record.cause = static_cast<Cause>(bits % 12);
  record.release = record.arrival + Duration(bits % 50'000'000);
  if ((bits & 8) != 0) record.payload_hash = bits * 0x9e3779b97f4a7c15;
  if ((bits & 16) != 0) record.actual = record.release + 80us;
  if ((bits & 32) != 0) {
    record.verdict = Verdict::kDuplicate;
    record.duplicate = record.release + 1ms;
  } else if ((bits & 64) != 0) {
    record.verdict = Verdict::kDrop;
  }
  if ((bits & 128) != 0) record.stale = {record.arrival + 2ms, static_cast<std::uint32_t>(1 + bits % 64)};
  if ((bits & 256) != 0) record.flipped_bit = static_cast<std::uint32_t>(bits % 9600);
  if ((bits & 512) != 0) record.truncated_to = static_cast<std::uint32_t>(bits % 1200);
  record.rebinds = static_cast<std::uint32_t>(bits >> 20 & 7);
  return record;
}

Trace any_trace(std::size_t count) {
  std::mt19937_64 random(7);
  Trace trace;
  trace.seed = 18'446'744'073'709'551'615U;
  trace.start = at(-5ms);
  trace.up = "delay=lognormal(20ms,5ms) loss=burst(2%,4)";
  trace.down = "delay=20ms";
  trace.tables = {0x0123456789abcdef, 0};
  trace.build = "v0.1.0-12-gabc1234";
  for (std::size_t i = 0; i < count; ++i) trace.records.push_back(record_of(i, random()));
  trace.notes = {{0, "begins"}, {count / 2, "5000000000 both wifi-bad"}, {count / 2, ""}, {count, "ends"}};
  return trace;
}

std::string written(const Trace& trace) {
  std::ostringstream text;
  write_trace(text, trace);
  return text.str();
}

Trace read(const std::string& text) {
  std::istringstream from(text);
  return read_trace(from, "run.csv");
}

std::string refusal(const std::string& text) {
  return thrown_by<std::runtime_error>([&] { read(text); });
}

constexpr std::string_view kColumns =
    "dir,link,index,t_in_ns,bytes,hash,verdict,cause,t_out_ns,t_actual_ns,duplicate_ns,stale_back,stale_ns,flipped_bit,"
    "truncated_to,rebinds\n";

std::string with_lines(std::string_view lines) {
  return "# tendon-trace 1\n# seed 7\n" + std::string(kColumns) + std::string(lines);
}

TEST(Trace, ReadsBackExactlyWhatWasWritten) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{5000}}) {
    const Trace trace = any_trace(count);
    EXPECT_EQ(read(written(trace)), trace);
    EXPECT_EQ(written(read(written(trace))), written(trace));
  }
}

TEST(Trace, AHeaderThatSaysNothingIsReadBackToo) {
  const Trace trace;
  EXPECT_EQ(read(written(trace)), trace);
}

TEST(Trace, ASparseTraceIsReadBackAsOne) {
  Trace trace = any_trace(10);
  trace.benign = {20ms, std::nullopt};
  EXPECT_TRUE(read(written(trace)).sparse());
  EXPECT_EQ(read(written(trace)), trace);
}

// Pins the format, because other programs read it and traces are kept.
TEST(Trace, TheTextIsTheOneThatIsDocumented) {
  Trace trace;
  trace.seed = 7;
  trace.up = "delay=20ms";
  trace.tables = {0x3c0ffee0ddba11ad};
  trace.build = "v0.1.0";
  TraceRecord record;
  record.arrival = at(1ms);
  record.size = 213;
  record.release = at(21340211ns);
  record.payload_hash = 0xb1946ac92492d234;
  record.actual = at(21391002ns);
  trace.records.push_back(record);
  record.direction = Direction::kDown;
  record.link = 2;
  record.index = 1;
  record.verdict = Verdict::kDuplicate;
  record.cause = Cause::kFifo;
  record.payload_hash.reset();
  record.actual.reset();
  record.duplicate = at(22ms);
  record.stale = {at(23ms), 5};
  record.flipped_bit = 9;
  record.truncated_to = 100;
  record.rebinds = 3;
  trace.records.push_back(record);
  trace.notes = {{1, "5000000 both wifi-bad"}};
  EXPECT_EQ(written(trace),
            "# tendon-trace 1\n# seed 7\n# start 0\n# up delay=20ms\n# tables 3c0ffee0ddba11ad\n"
            "# build v0.1.0\n" +
                std::string(kColumns) +
                "up,0,0,1000000,213,b1946ac92492d234,pass,delay,21340211,21391002,,,,,,0\n"
                "# note 5000000 both wifi-bad\n"
                "down,2,1,1000000,213,,dup,fifo,21340211,,22000000,5,23000000,9,100,3\n");
}

TEST(Trace, RecordsOfOneFlowMayComeInAnyOrder) {
  const std::string text = with_lines(
      "up,0,1,2000,9,,drop,loss,2000,,,,,,,0\n"
      "up,0,0,1000,9,,pass,delay,9000,,,,,,,0\n");
  EXPECT_EQ(read(text).records.front().index, 1U);
}

TEST(Trace, WhatIsWrongIsNamedWithFileAndLine) {
  for (const auto& [text, complaint] : std::vector<std::pair<std::string, std::string>>{
           {"", "1: expected the first line of a trace, \"# tendon-trace 1\""},
           {"# tendon-trace 2\n", "1: expected the first line of a trace, \"# tendon-trace 1\""},
           {"# tendon-trace 1\n", "2: the trace ends before its column names"},
           {"# tendon-trace 1\n# sed 7\n",
            "2: # \"sed\": unknown, expected seed, start, up, down, tables, build, benign up or benign down"},
           {"# tendon-trace 1\n# seed 7\n# seed 7\n", "3: # seed occurs twice"},
           {"# tendon-trace 1\n# seed -1\n", "2: seed is \"-1\", expected a whole number"},
           {"# tendon-trace 1\n# seed\n", "2: # seed has no value"},
           {"# tendon-trace 1\n# benign up -1\n", "2: benign up is \"-1\", expected a delay of 0 ns or more"},
           {"# tendon-trace 1\n# down a\rb\n", "2: found a carriage return, expected lines that end with \\n"},
           {"# tendon-trace 1\n# tables 12 34\n", "2: tables is \"12\", expected 16 hexadecimal digits"}}) {
    EXPECT_EQ(refusal(text), "run.csv:" + complaint);
  }
  EXPECT_EQ(refusal("# tendon-trace 1\nup,0,0\n").substr(0, 36), "run.csv:2: expected the column names");
  const std::string good = "up,0,0,1000,9,,pass,delay,9000,,,,,,,0\n";
  const std::string earlier = "t_in_ns is earlier than that of a datagram of the same flow with a smaller index";
  for (const auto& [lines, complaint] : std::vector<std::pair<std::string, std::string>>{
           {"# note a\rb\n", "4: found a carriage return, expected lines that end with \\n"},
           {"up,0,0\n", "4: expected 16 fields, found 3"},
           {good + "left,0,1,1000,9,,pass,delay,9000,,,,,,,0\n", "5: dir is \"left\", expected up or down"},
           {"up,0,0,1000,9,,lost,delay,9000,,,,,,,0\n", "4: verdict is \"lost\", expected pass, drop or dup"},
           {"up,0,0,1000,9,,pass,magic,9000,,,,,,,0\n", "4: cause is \"magic\", which is unknown"},
           {"up,0,0,1000,9,,pass,delay,999,,,,,,,0\n", "4: t_out_ns is earlier than t_in_ns"},
           {"up,0,0,1e9,9,,pass,delay,999,,,,,,,0\n", "4: t_in_ns is \"1e9\", expected whole nanoseconds"},
           {"up,0,0,9000000000000000000,9,,pass,delay,9000000000000000000,,,,,,,0\n",
            "4: t_in_ns is \"9000000000000000000\", expected a time within 73 years of zero"},
           {"up,0,0,1000,9,12,pass,delay,9000,,,,,,,0\n", "4: hash is \"12\", expected 16 hexadecimal digits"},
           {"up,0,0,1000,9,,dup,delay,9000,,,,,,,0\n",
            "4: duplicate_ns: expected a time where verdict is dup, and none elsewhere"},
           {"up,0,0,1000,9,,pass,delay,9000,,,4,,,,0\n", "4: stale_back and stale_ns: expected both or neither"},
           {"up,0,0,1000,9,,pass,delay,9000,,,65,2000,,,0\n", "4: stale_back is \"65\", expected 1 to 64"},
           {good + "# note half\n" + good, "6: datagram 0 of this flow occurs twice, first in line 4"},
           {good + "up,0,1,999,9,,pass,delay,9000,,,,,,,0\n", "5: " + earlier},
           {"up,0,1,999,9,,pass,delay,9000,,,,,,,0\n" + good, "4: " + earlier},
           {good.substr(0, 20), "4: the last line is incomplete; remove it to use the rest of the trace"}}) {
    EXPECT_EQ(refusal(with_lines(lines)), "run.csv:" + complaint);
  }
}

TEST(Trace, NoBytesWhateverDoMoreThanAnError) {
  std::mt19937_64 random(1);
  const std::string good = written(any_trace(20));
  constexpr std::string_view kLikely = ",,\n\n0123456789-# abcdefupdown\r\0\xff";
  std::size_t read_well = 0;
  for (int run = 0; run < 4000; ++run) {
    std::string text = good;
    for (std::uint64_t changes = random() % 4; changes > 0; --changes) {
      const std::size_t where = random() % text.size();
      switch (random() % 3) {
        case 0:
          text[where] = kLikely[random() % kLikely.size()];
          break;
        case 1:
          text.erase(where, random() % 40);
          break;
        default:
          text.insert(where, text.substr(random() % text.size(), random() % 40));
      }
      if (text.empty()) break;
    }
    try {
      const Trace trace = read(text);
      ++read_well;
      EXPECT_EQ(read(written(trace)), trace);
    } catch (const std::runtime_error&) {
    }
  }
  EXPECT_GT(read_well, 500U);
}

TEST(Trace, AHeaderWithALineBreakIsRefusedAndANoteLosesIt) {
  Trace trace;
  trace.up = "delay=20ms\n# seed 8";
  EXPECT_THROW(written(trace), std::invalid_argument);
  trace.up.clear();
  trace.notes = {{0, "one\ntwo\r"}};
  EXPECT_EQ(read(written(trace)).notes.front().text, "one two ");
}

TEST(Trace, DelaysAreExportedInMillisecondsWithoutRounding) {
  Trace trace;
  trace.start = at(1s);
  TraceRecord record;
  record.arrival = at(1s + 1ns);
  record.release = at(1s + 20'500'001ns);
  record.actual = at(1s + 20'600'000ns);
  trace.records.push_back(record);
  record.index = 1;
  record.verdict = Verdict::kDrop;
  record.actual.reset();
  trace.records.push_back(record);
  std::ostringstream text;
  write_delays(text, trace);
  EXPECT_EQ(text.str(),
            "dir,link,index,t_ms,delay_ms,actual_delay_ms\n"
            "up,0,0,0.000001,20.500000,20.599999\n"
            "up,0,1,0.000001,,\n");
}

// The vectors of xxHash's own specification tool: xxhsum -H1 of "", "a" and "abc".
TEST(Trace, PayloadsAreHashedWithXxh64) {
  const auto hash = [](std::string_view text) { return payload_hash(std::as_bytes(std::span(text))); };
  EXPECT_EQ(hash(""), 0xef46db3751d8e999U);
  EXPECT_EQ(hash("a"), 0xd24ec4f1a98c6e5bU);
  EXPECT_EQ(hash("abc"), 0x44bc2cf5ad770999U);
}

}  // namespace
}  // namespace tendon::injector::trace_test
