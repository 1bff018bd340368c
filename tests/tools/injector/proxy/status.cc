// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/status.h"

#include <cstdio>
#include <string_view>

namespace tendon::injector {
namespace {

std::string fixed(double value, int digits) {
  std::array<char, 64> text{};
  const int length = std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return {text.data(), static_cast<std::size_t>(length)};
}

std::string us(Duration d) { return fixed(static_cast<double>(d.count()) / 1e3, 1); }

std::string quantiles_json(const DurationHistogram& of) {
  return R"({"n":)" + std::to_string(of.count()) + R"(,"p50":)" + us(of.quantile(0.5)) + R"(,"p95":)" +
         us(of.quantile(0.95)) + R"(,"p99":)" + us(of.quantile(0.99)) + R"(,"max":)" + us(of.max()) + "}";
}

std::string direction_json(const ProxyMeasurements& measured) {
  const ProxyCounters& n = measured.counters;
  std::string lost_by;
  for (std::size_t cause = 0; cause < kCauses; ++cause) {
    if (n.dropped[cause] == 0) continue;
    lost_by += (lost_by.empty() ? "\"" : ",\"") + std::string(to_string(static_cast<Cause>(cause))) +
               "\":" + std::to_string(n.dropped[cause]);
  }
  const auto count = [](const char* name, std::uint64_t value) {
    return std::string(",\"") + name + "\":" + std::to_string(value);
  };
  return R"({"received":)" + std::to_string(n.received) + count("forwarded", n.forwarded) + count("lost", n.lost()) +
         R"(,"lost_by":{)" + lost_by + "}" + count("duplicated", n.duplicated) + count("replayed", n.replayed) +
         count("flipped", n.flipped) + count("truncated", n.truncated) + count("refused_clients", n.refused_clients) +
         count("refused_full", n.refused_full) + count("unsent", n.unsent) + R"(,"delay_us":)" +
         quantiles_json(measured.delay) + R"(,"release_error_us":)" + quantiles_json(measured.release_error) + "}";
}

}  // namespace

std::string json_string(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04x", static_cast<unsigned>(c));
      result += escape.data();
    } else {
      result += c;
    }
  }
  return result + '"';
}

std::vector<std::string> why_invalid(const Status& status, Duration max_release_error) {
  std::vector<std::string> why;
  const auto add_count = [&](std::uint64_t count, const std::string& what) {
    if (count > 0) why.push_back(std::to_string(count) + " datagrams " + what);
  };
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    const Duration p99 = status.of(direction).release_error.quantile(0.99);
    if (p99 <= max_release_error) continue;
    why.push_back(std::string(direction == Direction::kUp ? "up" : "down") + ": one datagram in a hundred left " +
                  us(p99) + " us late or later, the bound is " + us(max_release_error) +
                  " us; the machine's own timer was " + us(status.timer_floor.quantile(0.99)) + " us late");
  }
  std::uint64_t full = 0;
  std::uint64_t unsent = 0;
  for (const ProxyMeasurements& measured : status.directions) {
    full += measured.counters.refused_full;
    unsent += measured.counters.unsent;
  }
  add_count(status.overflowed, "were thrown away by the kernel because the proxy did not read them in time");
  add_count(full, "did not fit into the proxy's memory");
  add_count(unsent, "were not taken by the kernel when they were due");
  add_count(status.unrecorded, "are missing in the trace because the disk was too slow");
  return why;
}

std::string json_members(const Status& status, Duration max_release_error) {
  const std::vector<std::string> why = why_invalid(status, max_release_error);
  std::string reasons;
  for (const std::string& reason : why) reasons += (reasons.empty() ? "" : ",") + json_string(reason);
  std::string json = R"("t_s":)" + fixed(seconds(status.elapsed), 3) + R"(,"clients":)" +
                     std::to_string(status.clients.size()) + R"(,"in_flight":)" + std::to_string(status.in_flight) +
                     R"(,"valid":)" + (why.empty() ? "true" : "false") + R"(,"invalid_because":[)" + reasons +
                     R"(],"overflowed":)" + std::to_string(status.overflowed) + R"(,"timer_floor_us":)" +
                     quantiles_json(status.timer_floor);
  if (status.scenario_steps > 0) {
    json += R"(,"scenario":{"steps":)" + std::to_string(status.scenario_steps) + R"(,"done":)" +
            std::to_string(status.scenario_done) + "}";
  }
  if (!status.last_change.empty()) json += R"(,"last_change":)" + json_string(status.last_change);
  return json + R"(,"up":)" + direction_json(status.of(Direction::kUp)) + R"(,"down":)" +
         direction_json(status.of(Direction::kDown));
}

}  // namespace tendon::injector
