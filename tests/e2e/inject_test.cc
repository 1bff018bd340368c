// SPDX-License-Identifier: Apache-2.0
// Tests tendon-inject between two programs that do not use Tendon. No times are measured.
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"
#include "tests/tools/injector/proxy/udp_batch.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::e2e::inject_test {
namespace {

using injector::Direction;
using injector::Trace;
using injector::TraceRecord;
using injector::UdpBatch;
using injector::Verdict;
using testing::ScratchFolder;

const std::vector<std::string> kAnyReleaseError = {"--max-release-error-us", "1e9"};

std::vector<std::string> with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// Sends `count` datagrams to `proxy` at intervals of 10 ms. If a datagram arrives, the server sends it back.
void send_through(UdpBatch& server, const std::string& proxy, int count) {
  UdpBatch client = UdpBatch::connected(parse_address(proxy));
  UdpBatch::Inbox inbox;
  for (int i = 0; i < count; ++i) {
    const std::string text = "datagram " + std::to_string(i);
    const UdpBatch::Outgoing datagram{{}, std::as_bytes(std::span(text))};
    client.send({&datagram, 1});
    ::poll(nullptr, 0, 10);
    for (const UdpBatch::Arrival& arrival : server.receive(inbox)) {
      const UdpBatch::Outgoing answer{arrival.from, arrival.datagram};
      server.send({&answer, 1});
    }
  }
}

std::string fates(const Trace& trace, Direction direction = Direction::kUp) {
  std::string result;
  for (const TraceRecord& record : trace.records) {
    if (record.direction != direction) continue;
    result.resize(std::max<std::size_t>(result.size(), record.index + 1), '?');
    result[record.index] = record.verdict == Verdict::kDrop ? '-' : record.verdict == Verdict::kPass ? '+' : '2';
  }
  return result;
}

TEST(Inject, ARecordedRunMeetsTheSameFatesOnceMore) {
  const ScratchFolder folder;
  UdpBatch server = UdpBatch::listening(parse_address("127.0.0.1:0"));
  const std::vector<std::string> to = with(kAnyReleaseError, {"--to", to_string(server.local_address())});
  {
    Service proxy("tendon-inject",
                  with(to, {"--profile", "loss=30% duplicate=20%", "--seed", "7", "--record", "first.csv"}),
                  folder.path(), "start", "listen");
    send_through(server, proxy.address(), 60);
    proxy.stop();
  }
  {
    Service proxy("tendon-inject", with(to, {"--replay", "first.csv", "--record", "second.csv"}), folder.path(),
                  "start", "listen");
    send_through(server, proxy.address(), 60);
    proxy.stop();
  }
  const std::string first = fates(injector::read_trace(folder.path() / "first.csv"));
  EXPECT_EQ(first.size(), 60U);
  EXPECT_NE(first.find('-'), std::string::npos) << first;
  EXPECT_NE(first.find('2'), std::string::npos) << first;
  EXPECT_EQ(fates(injector::read_trace(folder.path() / "second.csv")), first);
}

TEST(Inject, ARunEndsWithItsTraceIfSoAskedAndSaysHowOftenItWasPlayed) {
  const ScratchFolder folder;
  UdpBatch server = UdpBatch::listening(parse_address("127.0.0.1:0"));
  const std::vector<std::string> to = with(kAnyReleaseError, {"--to", to_string(server.local_address())});
  {
    Service proxy("tendon-inject", with(to, {"--profile", "delay=40ms", "--record", "first.csv"}), folder.path(),
                  "start", "listen");
    send_through(server, proxy.address(), 10);
    ::poll(nullptr, 0, 200);
    proxy.stop();
  }
  Service proxy("tendon-inject",
                with(to, {"--replay", "first.csv", "--at-end", "stop", "--add", "loss=pattern(01)", "--seed", "9",
                          "--record", "second.csv"}),
                folder.path(), "start", "listen");
  send_through(server, proxy.address(), 14);
  EXPECT_EQ(proxy.process().wait(), 0) << proxy.process().err();
  const std::string end = proxy.process().out().substr(proxy.process().out().rfind("{\"event\":\"end\""));
  EXPECT_NE(end.find(R"("up":{"received":1)"), std::string::npos) << end;
  EXPECT_NE(end.find(R"("played":1.0,)"), std::string::npos) << end;
  EXPECT_NE(end.find(R"("in_flight":0,)"), std::string::npos) << end;
  const Trace second = injector::read_trace(folder.path() / "second.csv");
  EXPECT_EQ(fates(second), "+-+-+-+-+-");
  EXPECT_EQ(second.up, "replay of first.csv, then loss=pattern(01)");
  EXPECT_EQ(second.seed, 9U);
}

TEST(Inject, ACaptureOfARunMeetsTheSameFatesOnceMore) {
  if (::geteuid() != 0 || !std::filesystem::exists("/usr/bin/tcpdump")) GTEST_SKIP() << "needs root and tcpdump";
  const ScratchFolder folder;
  UdpBatch server = UdpBatch::listening(parse_address("127.0.0.1:0"));
  const std::vector<std::string> to = with(kAnyReleaseError, {"--to", to_string(server.local_address())});
  const auto port = [](const std::string& address) { return address.substr(address.rfind(':') + 1); };
  constexpr int kCount = 150;
  Process tcpdump("/usr/bin/tcpdump",
                  {"-i", "lo", "-s", "0", "-U", "-Z", "root", "--immediate-mode", "-w", "run.pcap", "udp"},
                  folder.path());
  tcpdump.wait_for_line("listening on lo");
  std::string client_port;
  {
    Service proxy("tendon-inject",
                  with(to, {"--up", "delay=15ms loss=30%", "--down", "delay=5ms loss=burst(20%,2)", "--seed", "7",
                            "--record", "first.csv"}),
                  folder.path(), "start", "listen");
    client_port = port(proxy.address());
    send_through(server, proxy.address(), kCount);
    proxy.stop();
  }
  tcpdump.signal(SIGINT);
  EXPECT_EQ(tcpdump.wait(), 0) << tcpdump.err();
  // A capture of the loopback interface contains both ends.
  Process import(program("tendon-inject"),
                 {"import", "pcap", "run.pcap", "run.pcap", "--port", client_port, "--server-port",
                  port(to_string(server.local_address())), "--out", "imported.csv"},
                 folder.path());
  ASSERT_EQ(import.wait(), 0) << import.err();
  const Trace first = injector::read_trace(folder.path() / "first.csv");
  const Trace imported = injector::read_trace(folder.path() / "imported.csv");
  const std::string up = fates(imported);
  // The last datagrams can be missing, because it is not known whether they arrived after the end of the capture.
  ASSERT_GT(up.size(), kCount * 9U / 10) << import.err();
  EXPECT_TRUE(fates(first).starts_with(up)) << fates(first) << "\n" << up;
  EXPECT_TRUE(fates(first, Direction::kDown).starts_with(fates(imported, Direction::kDown)));
  {
    Service proxy("tendon-inject", with(to, {"--replay", "imported.csv", "--at-end", "stop", "--record", "second.csv"}),
                  folder.path(), "start", "listen");
    send_through(server, proxy.address(), static_cast<int>(up.size()));
    proxy.process().signal(SIGTERM);
    proxy.process().wait();
  }
  const std::string again = fates(injector::read_trace(folder.path() / "second.csv"));
  EXPECT_GT(again.size(), kCount * 8U / 10);
  EXPECT_TRUE(up.starts_with(again)) << up << "\n" << again;
}

TEST(Inject, AServerIsFoundByItsHostName) {
  const ScratchFolder folder;
  UdpBatch server = UdpBatch::listening(parse_address("127.0.0.1:0"));
  const std::string port = to_string(server.local_address()).substr(std::string("127.0.0.1").size());
  // parse_address() accepts neither this spelling nor names in general, so /etc/hosts resolves it.
  Service proxy("tendon-inject", with(kAnyReleaseError, {"--to", "LOCALHOST" + port, "--record", "run.csv"}),
                folder.path(), "start", "listen");
  send_through(server, proxy.address(), 3);
  EXPECT_NE(proxy.process().out().find("LOCALHOST" + port + " (127.0.0.1" + port + ")"), std::string::npos)
      << proxy.process().out();
  proxy.stop();
  EXPECT_EQ(fates(injector::read_trace(folder.path() / "run.csv")), "+++");
}

TEST(Inject, AHostThatNobodyKnowsIsNamedAndFails) {
  const ScratchFolder folder;
  Process proxy(program("tendon-inject"), {"--listen", "127.0.0.1:0", "--to", "haptics.invalid:47100"}, folder.path());
  EXPECT_EQ(proxy.wait(), 1);
  EXPECT_NE(proxy.err().find("cannot find haptics.invalid: "), std::string::npos) << proxy.err();
}

TEST(Inject, ARunThatCouldNotKeepUpIsInvalidAndFails) {
  const ScratchFolder folder;
  UdpBatch server = UdpBatch::listening(parse_address("127.0.0.1:0"));
  Service proxy("tendon-inject", {"--to", to_string(server.local_address()), "--max-release-error-us", "0"},
                folder.path(), "start", "listen");
  send_through(server, proxy.address(), 3);
  proxy.process().signal(SIGINT);
  EXPECT_EQ(proxy.process().wait(), 1);
  EXPECT_NE(proxy.process().out().find(R"("valid":false,"invalid_because":["up: one datagram in a hundred)"),
            std::string::npos)
      << proxy.process().out();
}

TEST(Inject, ARunInWhichNothingCameBackIsInvalidAndSaysSo) {
  const ScratchFolder folder;
  Address nobody;
  { nobody = UdpBatch::listening(parse_address("127.0.0.1:0")).local_address(); }
  Service proxy("tendon-inject", with(kAnyReleaseError, {"--to", to_string(nobody)}), folder.path(), "start", "listen");
  UdpBatch deaf = UdpBatch::listening(parse_address("127.0.0.1:0"));
  send_through(deaf, proxy.address(), 3);
  proxy.process().wait_for_line(R"("forwarded":3)");
  proxy.process().signal(SIGINT);
  EXPECT_EQ(proxy.process().wait(), 1);
  const std::string why = "no answer from " + to_string(nobody);
  EXPECT_NE(proxy.process().out().find("\"invalid_because\":[\"" + why), std::string::npos) << proxy.process().out();
  EXPECT_NE(proxy.process().err().find("tendon-inject: " + why), std::string::npos) << proxy.process().err();
}

TEST(Inject, SaysThatFurtherClientsAreRefusedAndWhy) {
  const ScratchFolder folder;
  UdpBatch server = UdpBatch::listening(parse_address("127.0.0.1:0"));
  Service proxy("tendon-inject",
                with(kAnyReleaseError, {"--to", to_string(server.local_address()), "--max-clients", "2"}),
                folder.path(), "start", "listen");
  for (int client = 0; client < 3; ++client) send_through(server, proxy.address(), 1);
  proxy.process().wait_for_line(R"("refused_clients":1)");
  proxy.stop();
  EXPECT_NE(proxy.process().err().find("tendon-inject: 1 datagrams of further clients refused: 2 clients are the "
                                       "maximum (--max-clients); a client is removed after 30 s of silence"),
            std::string::npos)
      << proxy.process().err();
}

TEST(Inject, TakesCommandsFromAnotherProgramWhileItRuns) {
  const ScratchFolder folder;
  UdpBatch server = UdpBatch::listening(parse_address("127.0.0.1:0"));
  Service proxy("tendon-inject",
                with(kAnyReleaseError,
                     {"--to", to_string(server.local_address()), "--control", "control", "--record", "run.csv"}),
                folder.path(), "start", "listen");
  const auto command = [&](std::vector<std::string> words) {
    Process control(program("tendon-inject"), with({"control", "control"}, words), folder.path());
    const int code = control.wait();
    return std::to_string(code) + " " + control.out() + control.err();
  };
  EXPECT_EQ(command({"up", "loss=100%"}), "0 ok\n");
  proxy.process().wait_for_line(R"("last_change":"up loss=100%")");
  send_through(server, proxy.address(), 3);
  EXPECT_EQ(command({"up loss=0%"}), "0 ok\n");
  proxy.process().wait_for_line(R"("last_change":"up loss=0%")");
  send_through(server, proxy.address(), 1);
  EXPECT_TRUE(command({"stats"}).starts_with("0 {\"t_s\":"));
  EXPECT_TRUE(command({"up", "loss=200%"}).starts_with("1 error: "));
  EXPECT_EQ(command({"stop"}), "0 ok\n");
  EXPECT_EQ(proxy.process().wait(), 0) << proxy.process().err();
  const Trace trace = injector::read_trace(folder.path() / "run.csv");
  EXPECT_EQ(trace.notes.size(), 2U);
  EXPECT_EQ(std::ranges::count(trace.records, Direction::kUp, &TraceRecord::direction), 4);
  EXPECT_EQ(std::ranges::count(trace.records, Verdict::kDrop, &TraceRecord::verdict), 3);
}

TEST(Inject, ADryRunPrintsOneObjectPerPacket) {
  const ScratchFolder folder;
  Process dry(program("tendon-inject"),
              {"--dry-run", "--count", "200", "--seed", "7", "--profile", "wifi-bad", "--json"}, folder.path());
  EXPECT_EQ(dry.wait(), 0) << dry.err();
  EXPECT_EQ(std::ranges::count(dry.out(), '\n'), 200);
  EXPECT_TRUE(dry.out().starts_with(R"({"dir":"up","index":0,"t_in_ns":0,"verdict":")")) << dry.out();
}

}  // namespace
}  // namespace tendon::e2e::inject_test
