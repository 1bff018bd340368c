// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/import.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/refusal.h"
#include "tests/tools/injector/traces/trace_player.h"

namespace tendon::injector::import_test {
namespace {

using namespace std::chrono_literals;

using Import = Trace (*)(std::istream&, const std::string&, const ImportOptions&);

Trace import(Import reader, const std::string& text, const ImportOptions& options = {}) {
  std::istringstream from(text);
  return reader(from, "file", options);
}

std::string refusal(Import reader, const std::string& text, const ImportOptions& options = {}) {
  return thrown_by<std::runtime_error>([&] { import(reader, text, options); });
}

/// Formats one direction as "index:t_in:delay" in ms, with "lost" for a loss.
std::string told(const Trace& trace, Direction direction) {
  std::ostringstream text;
  for (const TraceRecord& record : trace.records) {
    if (record.direction != direction) continue;
    const auto ms = [](Duration duration) { return static_cast<double>(duration.count()) / 1e6; };
    text << record.index << ':' << ms(record.arrival - LocalTime{}) << ':';
    if (record.verdict == Verdict::kDrop) {
      text << "lost ";
    } else {
      text << ms(record.release - record.arrival) << ' ';
    }
  }
  return text.str();
}

std::string up(const Trace& trace) { return told(trace, Direction::kUp); }
std::string down(const Trace& trace) { return told(trace, Direction::kDown); }

constexpr const char* kPing =
    "PING host (192.168.9.174) 56(84) bytes of data.\n"
    "64 bytes from host (192.168.9.174): icmp_seq=2 ttl=64 time=20 ms\n"
    "64 bytes from host (192.168.9.174): icmp_seq=2 ttl=64 time=21 ms (DUP!)\n"
    "no answer yet for icmp_seq=3\n"
    "From 192.168.9.1 icmp_seq=4 Destination Host Unreachable\n"
    "64 bytes from host (192.168.9.174): icmp_seq=6 ttl=64 time=10.5 ms\n"
    "64 bytes from host (192.168.9.174): icmp_seq=5 ttl=64 time=1011 ms\n"
    "\n"
    "--- host ping statistics ---\n"
    "8 packets transmitted, 3 received, +1 duplicates, 62.5% packet loss, time 7014ms\n"
    "rtt min/avg/max/mdev = 10.5/1/1/1 ms\n";

TEST(ImportPing, GapsAndWhatWasNeverAnsweredAreLosses) {
  const Trace trace = import(import_ping, kPing, {.share = Share::kUp});
  EXPECT_EQ(up(trace), "0:0:lost 1:1002:20 2:2004:lost 3:3006:lost 4:4008:1011 5:5010:10.5 6:6012:lost 7:7014:lost ");
  EXPECT_EQ(down(trace), "");
  EXPECT_EQ(trace.records[0].cause, Cause::kLoss);
  EXPECT_EQ(trace.records[1].cause, Cause::kDelay);
  EXPECT_EQ(trace.records[1].size, 64U);
}

TEST(ImportPing, ARoundTripIsHalvedAndALostOneIsLostOnce) {
  const Trace trace = import(import_ping, kPing);
  EXPECT_EQ(up(trace), "0:0:lost 1:1002:10 2:2004:lost 3:3006:lost 4:4008:505.5 5:5010:5.25 6:6012:lost 7:7014:lost ");
  EXPECT_EQ(down(trace), "1:1012:10 4:4513.5:505.5 5:5015.25:5.25 ");
  EXPECT_EQ(down(import(import_ping, kPing, {.share = Share::kDown})).substr(0, 20), "0:0:lost 1:1002:20 2");
}

TEST(ImportPing, TimeStampsSayWhenRequestsWereSent) {
  const std::string stamped =
      "[1700000000.000000] 64 bytes from 10.0.0.1: icmp_seq=10 ttl=64 time=4 ms\n"
      "[1700000000.306000] 64 bytes from 10.0.0.1: icmp_seq=13 ttl=64 time=10 ms\n";
  const Trace trace = import(import_ping, stamped, {.share = Share::kUp});
  EXPECT_EQ(up(trace), "0:0:4 1:100:lost 2:200:lost 3:300:10 ");
  EXPECT_EQ(trace.records[0].size, 64U);
}

TEST(ImportPing, WhatBusyboxPrintsIsUnderstoodToo) {
  const std::string busybox =
      "PING 8.8.8.8 (8.8.8.8): 56 data bytes\n"
      "64 bytes from 8.8.8.8: seq=0 ttl=118 time=5.332 ms\n"
      "64 bytes from 8.8.8.8: seq=2 ttl=118 time=5.5 ms\n"
      "\n"
      "--- 8.8.8.8 ping statistics ---\n"
      "3 packets transmitted, 2 packets received, 33% packet loss\n";
  EXPECT_EQ(up(import(import_ping, busybox, {.share = Share::kBoth, .interval = 200ms})),
            "0:0:5.332 1:200:lost 2:400:5.5 ");
}

std::string ping_of(const std::vector<std::string>& times) {
  std::string text;
  for (const std::string& time : times) {
    text += "64 bytes from 192.0.2.7: icmp_seq=" + std::to_string(std::ranges::count(text, '\n')) +
            " ttl=64 time=" + time + "\n";
  }
  return text;
}

TEST(ImportPing, UnderstandsTimesHoweverTheyAreWritten) {
  const auto delays = [](const std::vector<std::string>& times) {
    std::string text;
    for (const TraceRecord& record : import(import_ping, ping_of(times), {.share = Share::kUp}).records) {
      text += std::to_string((record.release - record.arrival).count()) + ' ';
    }
    return text;
  };
  EXPECT_EQ(delays({"0.481 ms", "20.497 ms"}), "481000 20497000 ");
  EXPECT_EQ(delays({"0,481 ms", "20,497 ms"}), "481000 20497000 ");
  EXPECT_EQ(delays({"20,497 ms", "21,003 ms"}), "20497000 21003000 ");
  EXPECT_EQ(delays({"381 us", "381 µs", "1.5 s", "2 ms (DUP!)"}), "381000 381000 1500000000 2000000 ");
  EXPECT_EQ(delays({"1,012.5 ms", "998 ms"}), "1012500000 998000000 ");
  EXPECT_EQ(delays({"1.012,5 ms", "998,25 ms"}), "1012500000 998250000 ");
}

TEST(ImportPing, ACommaThatMayBeEitherIsRefused) {
  EXPECT_EQ(
      refusal(import_ping, ping_of({"998 ms", "1,012 ms"})),
      "file:2: expected a decimal point, found time=1,012: is the comma a decimal comma, or a thousands separator?");
  EXPECT_EQ(
      refusal(import_ping, ping_of({"99.5 ms", "1,012 ms"})),
      "file:2: expected a decimal point, found time=1,012: is the comma a decimal comma, or a thousands separator?");
  EXPECT_EQ(refusal(import_ping, ping_of({"99.5 ms", "1,5 ms"})),
            "file:2: expected the decimal sign of line 1, found another");
  for (const char* time : {"1,01,2.5 ms", "1.2.3 ms", "5 parsecs", "5", ", ms"}) {
    EXPECT_EQ(refusal(import_ping, ping_of({time})).substr(0, 37), "file:1: expected time=… ms, us or s") << time;
  }
}

TEST(ImportPing, SequenceNumbersGoOnBeyond16Bits) {
  std::string text;
  for (int i = 65'534; i < 65'540; ++i) {
    text += "64 bytes from 10.0.0.1: icmp_seq=" + std::to_string(i % 65'536) + " ttl=64 time=1 ms\n";
  }
  EXPECT_EQ(import(import_ping, text, {.share = Share::kUp}).records.size(), 6U);
}

TEST(ImportPing, WhatIsNotPingIsRefused) {
  EXPECT_EQ(refusal(import_ping, "hello\n"),
            "file: has no answers; expected the English output of ping on Linux or macOS: LC_ALL=C ping");
  EXPECT_EQ(refusal(import_ping, "\n64 bytes from 10.0.0.1: icmp_seq=1 ttl=64 time=fast\n").substr(0, 37),
            "file:2: expected time=… ms, us or s");
  EXPECT_EQ(refusal(import_ping, "64 bytes from 10.0.0.1: icmp_seq=70000 ttl=64 time=1 ms\n").substr(0, 37),
            "file:1: expected icmp_seq=0 to 65535 ");
  EXPECT_EQ(refusal(import_ping, kPing, {.share = Share::kMeasured}),
            "file: has one delay for each packet, expected --share up, down, both or halves");
}

// From the documentation of irtt, shortened; entries from the third on have losses of each kind.
constexpr const char* kIrtt = R"({
  "version": {"irtt": "0.9.0"},
  "config": {"params": {"interval": 200000000, "length": 48}},
  "round_trips": [
    {"seqno": 0, "lost": "false",
     "timestamps": {"client": {"receive": {"wall": 1508180723502871779, "monotonic": 2921143},
                               "send": {"wall": 1508180723502727340, "monotonic": 2776704}},
                    "server": {"receive": {}, "send": {}}},
     "delay": {"receive": 45177, "rtt": 134460, "send": 89283}, "ipdv": {}},
    {"seqno": 1, "lost": false,
     "timestamps": {"client": {"send": {"wall": 1508180723702807328, "monotonic": 202856692}}},
     "delay": {"receive": 45268, "rtt": 99455, "send": 54187}, "ipdv": {"rtt": -35005}},
    {"seqno": 2, "lost": "true_up", "timestamps": {"client": {"send": {"monotonic": 402776704}}}, "delay": {}},
    {"seqno": 3, "lost": "true_down", "timestamps": {"client": {"send": {"monotonic": 602776704}}}, "delay": {}},
    {"seqno": 4, "lost": "true", "timestamps": {"client": {"send": {"monotonic": 802776704}}}, "delay": {}}
  ]})";

TEST(ImportIrtt, TakesTheMeasuredDelayOfEachDirection) {
  const Trace trace = import(import_irtt, kIrtt, {.share = Share::kMeasured});
  EXPECT_EQ(up(trace), "0:0:0.089283 1:200.08:0.054187 2:400:lost 4:800:lost ");
  EXPECT_EQ(down(trace), "0:0.089283:0.045177 1:200.134:0.045268 3:600:lost ");
  EXPECT_EQ(trace.records[0].size, 48U);
}

TEST(ImportIrtt, HalvesTheRoundTripWhenAsked) {
  const Trace trace = import(import_irtt, kIrtt, {.share = Share::kHalves});
  EXPECT_EQ(up(trace), "0:0:0.06723 1:200.08:0.049727 2:400:lost 3:600:lost 4:800:lost ");
  EXPECT_EQ(down(trace), "0:0.06723:0.06723 1:200.13:0.049728 ");
}

TEST(ImportIrtt, ClocksThatWereNotSynchronisedAreRefused) {
  std::string text = kIrtt;
  text.replace(text.find("89283"), 5, "-9283");
  EXPECT_EQ(refusal(import_irtt, text, {.share = Share::kMeasured}),
            "file: round_trips[0].delay.send is -9283 ns, because the clocks of client and server were not "
            "synchronized; import half of the round trip instead, with --share halves");
}

TEST(ImportIrtt, WhatIsNotItsResultIsRefused) {
  EXPECT_EQ(refusal(import_irtt, "{}"), "file: expected round_trips, as in the JSON file of irtt client -o");
  EXPECT_EQ(refusal(import_irtt, "{").substr(0, 15), "file: not JSON:");
  EXPECT_EQ(refusal(import_irtt, R"({"round_trips": [{"lost": "maybe"}]})"),
            "file: round_trips[0].lost: expected false, true, true_up or true_down");
  EXPECT_EQ(refusal(import_irtt, R"({"round_trips": [{"lost": false, "delay": {}}]})"),
            "file: round_trips[0].delay.rtt: expected whole nanoseconds");
  EXPECT_EQ(refusal(import_irtt, std::string(100'000, '[')), "file: nested too deeply for a result of irtt");
}

TEST(ImportCsv, AListOfDelaysIsOnePacketPerLine) {
  const Trace trace = import(import_csv, "20\n\n21.5\n", {.share = Share::kBoth, .interval = 1ms});
  EXPECT_EQ(up(trace), "0:0:20 1:1:lost 2:2:21.5 ");
  EXPECT_EQ(down(trace), up(trace));
}

TEST(ImportCsv, TimesAreTakenFromTheFileAndBeginAtZero) {
  EXPECT_EQ(
      up(import(import_csv, "# a comment\nt_ms;delay_ms\n1000;20\r\n1010;\r\n1025;30\r\n", {.share = Share::kUp})),
      "0:0:20 1:10:lost 2:25:30 ");
  EXPECT_EQ(up(import(import_csv, "what\tdelay_ms\tt_ms\nx\t5\t7\ny\t6\t9\n", {.share = Share::kUp})), "0:0:5 1:2:6 ");
}

TEST(ImportCsv, WhatIsWrongIsNamedWithItsLine) {
  EXPECT_EQ(refusal(import_csv, ""), "file: has no delays");
  EXPECT_EQ(refusal(import_csv, "a,b\n"),
            "file:1: expected numbers, or names of columns with delay_ms among them, found \"a,b\"");
  const std::string named = "t_ms,delay_ms\n";
  EXPECT_EQ(refusal(import_csv, named + "3,four\n"), "file:2: expected a finite number as delay_ms, found 'four'");
  EXPECT_EQ(refusal(import_csv, named + "3\n"), "file:2: expected 2 cells as in the first row, found 1");
  EXPECT_EQ(refusal(import_csv, named + "5,2\n3,2\n"), "file:3: the time is earlier than the previous one");
  EXPECT_EQ(refusal(import_csv, named + "1,-2\n"), "file:2: the delay is below zero");
  EXPECT_EQ(refusal(import_csv, named + "1,86400001\n"), "file:2: expected at most 1 days, found \"86400001\"");
}

TEST(ImportCsv, TwoColumnsWithoutNamesAreRefusedAndBothReadingsNamed) {
  EXPECT_EQ(refusal(import_csv, "20,1\n35,5\n41,0\n"),
            "file:1: expected one delay in ms in each line, or a first line with the names of the columns, like "
            "t_ms;delay_ms, found 2 numbers in \"20,1\": are these decimal commas, or are they time and delay?");
  EXPECT_EQ(refusal(import_csv, "20;1\n35;5\n"),
            "file:1: expected one delay in ms in each line, or a first line with the names of the columns, like "
            "t_ms;delay_ms, found 2 numbers in \"20;1\"");
}

TEST(ImportCsv, ReadsWhatSpreadsheetsWriteOrRefusesIt) {
  const ImportOptions up_only{.share = Share::kUp};
  EXPECT_EQ(up(import(import_csv, "\xef\xbb\xbft_ms,delay_ms\n0,20.1\n10,35.5\n", up_only)), "0:0:20.1 1:10:35.5 ");
  EXPECT_EQ(up(import(import_csv, "t_ms;delay_ms\n0;20,1\n10;35,5\n", up_only)), "0:0:20.1 1:10:35.5 ");
  EXPECT_EQ(up(import(import_csv, "Time [s]\tDelay [us]\n0\t20100\n0,5\t35500\n", up_only)), "0:0:20.1 1:500:35.5 ");
  EXPECT_EQ(up(import(import_csv, "t_ms,note,delay_ms\n0,\"a, b\",5\n", up_only)), "0:0:5 ");
  const std::string ragged =
      " as in the first row, found 2; are these decimal commas? Use decimal points, or separate the cells by "
      "semicolons";
  EXPECT_EQ(refusal(import_csv, "delay_ms\n20,1\n"), "file:2: expected 1 cell" + ragged);
  EXPECT_EQ(refusal(import_csv, "20\n20,1\n"), "file:2: expected 1 cell" + ragged);
}

TEST(ImportCsv, ASummarySaysHowManyWhenAndHowLong) {
  const Trace trace = import(import_csv, "t_ms,delay_ms\n0,20.1\n10,35.5\n20,\n30,21\n", {.share = Share::kUp});
  EXPECT_EQ(import_summary(trace), "up: 4 datagrams from 0ms to 30ms, 1 lost; delay 20.1ms to 35.5ms, median 21ms\n");
  const Trace both = import(import_csv, "5\n", {.share = Share::kBoth});
  EXPECT_EQ(import_summary(both),
            "up: 1 datagrams from 0ms to 0ms, 0 lost; delay 5ms to 5ms, median 5ms\n"
            "down: 1 datagrams from 0ms to 0ms, 0 lost; delay 5ms to 5ms, median 5ms\n");
}

TEST(ImportCsv, ReadsBackExportedDelays) {
  Trace trace;
  trace.start = LocalTime(5s);
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    for (std::uint64_t i = 0; i < 200; ++i) {
      TraceRecord record;
      record.direction = direction;
      record.index = i;
      record.arrival = LocalTime(5s + 1'000'003ns * i);
      record.release = record.arrival + Duration(i * i * 7919);
      record.verdict = i % 5 == 0 ? Verdict::kDrop : Verdict::kPass;
      trace.records.push_back(record);
    }
  }
  std::ostringstream exported;
  write_delays(exported, trace);
  const Trace back = import(import_csv, exported.str());
  ASSERT_EQ(back.records.size(), trace.records.size());
  for (std::size_t i = 0; i < back.records.size(); ++i) {
    const TraceRecord& a = trace.records[i];
    const TraceRecord& b = back.records[i];
    EXPECT_EQ(a.direction, b.direction);
    EXPECT_EQ(a.index, b.index);
    EXPECT_EQ(a.arrival - trace.start, b.arrival - LocalTime{});
    EXPECT_EQ(a.verdict, b.verdict);
    if (a.verdict == Verdict::kPass) {
      EXPECT_EQ(a.release - a.arrival, b.release - b.arrival);
    }
  }
}

TEST(ImportMahimahiLog, DeparturesAreDatagramsAndDropsAreLost) {
  const std::string log =
      "# mahimahi mm-link (uplink) [trace] > log\n# base timestamp: 100\n100 + 1504\n103 # 1504\n103 - 1504 3\n"
      "104 + 600\n105 + 700\n106 d 2 1300\n109 - 600 5\n";
  EXPECT_EQ(up(import(import_mahimahi_log, log, {.share = Share::kUp})), "0:0:3 1:4:5 2:6:lost 3:6:lost ");
  EXPECT_EQ(refusal(import_mahimahi_log, "100 - 1504\n", {.share = Share::kUp}),
            "file:1: expected the delay in ms after the bytes");
  EXPECT_EQ(refusal(import_mahimahi_log, "12\n", {.share = Share::kUp}),
            "file:1: expected a line of a log of mm-link, like \"512 - 1504 20\"");
  EXPECT_EQ(refusal(import_mahimahi_log, log), "file: is the log of one direction, expected --share up, down or both");
}

TEST(Import, EveryImportIsATraceThatReadsBack) {
  for (const Trace& trace : {import(import_ping, kPing), import(import_irtt, kIrtt, {.share = Share::kMeasured}),
                             import(import_csv, "20\n\n21\n")}) {
    std::stringstream file;
    write_trace(file, trace);
    EXPECT_EQ(read_trace(file, "file"), trace);
  }
}

TEST(Import, NoBytesWhateverDoMoreThanAnError) {
  std::mt19937_64 random(1);
  constexpr std::string_view kLikely = ",;\n\n0123456789-#.[]{}\" :abcdefupdownseq=\r\0\xff";
  const std::vector<std::pair<Import, std::string>> all = {
      {import_ping, kPing},
      {import_irtt, kIrtt},
      {import_csv, "t_ms,delay_ms,dir\n1,2,up\n2,,down\n3,4,up\n"},
      {import_mahimahi_log, "100 + 1504\n103 # 1504\n103 - 1504 3\n106 d 2 1300\n"}};
  for (int run = 0; run < 2000; ++run) {
    auto [reader, text] = all[static_cast<std::size_t>(run) % all.size()];
    for (std::uint64_t changes = 1 + random() % 4; changes > 0; --changes) {
      const std::size_t where = random() % text.size();
      if (random() % 3 == 0) {
        text.insert(where, text.substr(random() % text.size(), random() % 20));
      } else {
        text[where] = kLikely[random() % kLikely.size()];
      }
    }
    try {
      const Trace trace = import(reader, text, {.share = Share::kUp});
      std::stringstream file;
      write_trace(file, trace);
      EXPECT_EQ(read_trace(file, "file"), trace) << text;
    } catch (const std::runtime_error&) {
    }
  }
}

// Of the DETERMINISTIC6G project. Packets, losses and medians are those of ping's summary or its sorted lines.
TEST(ImportPing, TheRealPingsHaveThePacketsAndDelaysThatTheirLinesSay) {
  const char* const data = std::getenv("TENDON_DATA");
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: the measured pings are not part of this repository";
  struct Real {
    const char* file;
    std::size_t packets;
    Duration shortest, longest, median;
    Duration total;
  };
  for (const Real& real : {Real{"ping-MEC-ORAN-upd.txt", 982, 9330us, 461ms, 24300us, 1'024'857ms},
                           Real{"ping-MEC-cmWave.txt", 877, 9480us, 23300us, 14400us, 878'774ms},
                           Real{"ping-cloud-mmWave.txt", 1297, 7500us, 41600us, 12ms, 1'362'175ms}}) {
    const auto path = std::filesystem::path(data) / "d6g-tsn-5g" / "ping" / real.file;
    std::ifstream file(path);
    ASSERT_TRUE(file) << path;
    const Trace trace = import_ping(file, real.file, {.share = Share::kUp});
    EXPECT_EQ(trace.records.size(), real.packets);
    EXPECT_TRUE(std::ranges::none_of(trace.records, [](auto& r) { return r.verdict == Verdict::kDrop; }));
    std::vector<Duration> delays;
    for (const TraceRecord& record : trace.records) delays.push_back(record.release - record.arrival);
    EXPECT_EQ(std::ranges::min(delays), real.shortest) << real.file;
    EXPECT_EQ(std::ranges::max(delays), real.longest) << real.file;
    EXPECT_EQ(median_delay(trace, Direction::kUp), real.median) << real.file;
    // The interval is rounded to nanoseconds.
    EXPECT_NEAR(static_cast<double>((trace.records.back().arrival - LocalTime{} - real.total).count()), 0, 1300);
  }
}

}  // namespace
}  // namespace tendon::injector::import_test
