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

/// Rounds to 0.1 µs, the resolution of the histogram.
double rounded_us(Duration d) { return with_decimals(static_cast<double>(d.count()) / 1e3, 1); }

JsonLine quantiles_json(const DurationHistogram& of) {
  JsonLine json;
  json.add("n", of.count())
      .add("p50", rounded_us(of.quantile(0.5)))
      .add("p95", rounded_us(of.quantile(0.95)))
      .add("p99", rounded_us(of.quantile(0.99)))
      .add("max", rounded_us(of.max()));
  return json;
}

JsonLine direction_json(const ProxyMeasurements& measured) {
  const ProxyCounters& n = measured.counters;
  JsonLine lost_by;
  for (std::size_t cause = 0; cause < kCauses; ++cause) {
    if (n.dropped[cause] > 0) lost_by.add(to_string(static_cast<Cause>(cause)), n.dropped[cause]);
  }
  JsonLine json;
  json.add("received", n.received)
      .add("forwarded", n.forwarded)
      .add("lost", n.lost())
      .add("lost_by", lost_by)
      .add("duplicated", n.duplicated)
      .add("replayed", n.replayed)
      .add("flipped", n.flipped)
      .add("truncated", n.truncated)
      .add("refused_clients", n.refused_clients)
      .add("refused_full", n.refused_full)
      .add("unsent", n.unsent);
  if (n.after_end > 0) json.add("after_end", n.after_end);
  if (measured.played > 0) json.add("played", with_decimals(measured.played, 2));
  json.add("delay_us", quantiles_json(measured.delay)).add("release_error_us", quantiles_json(measured.release_error));
  return json;
}

}  // namespace

std::string played_text(double times) {
  std::string text = fixed(times, 2);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

bool is_unanswered(const Status& status) noexcept {
  return status.of(Direction::kUp).counters.forwarded > 0 && status.of(Direction::kDown).counters.received == 0;
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
                  us(p99) + " us late or later, expected at most " + us(max_release_error) +
                  " us; the timer of this machine was " + us(status.timer_floor.quantile(0.99)) + " us late");
  }
  std::uint64_t full = 0;
  std::uint64_t unsent = 0;
  for (const ProxyMeasurements& measured : status.directions) {
    full += measured.counters.refused_full;
    unsent += measured.counters.unsent;
  }
  add_count(status.overflowed, "were dropped by the kernel because the proxy did not read them in time");
  add_count(full, "did not fit in the memory of the proxy");
  add_count(unsent, "were refused by the kernel at their time of release");
  add_count(status.late_rebinds, "were sent from the old port, because the system provided no socket for the new one");
  if (is_unanswered(status)) {
    why.push_back("no answer from " + to_string(status.server) + " to " +
                  std::to_string(status.of(Direction::kUp).counters.forwarded) + " datagrams");
  }
  add_count(status.unrecorded, "are missing in the trace because the disk was too slow");
  return why;
}

JsonLine in_json(const Status& status, Duration max_release_error) {
  const std::vector<std::string> why = why_invalid(status, max_release_error);
  JsonLine json;
  json.add("t_s", with_decimals(seconds(status.elapsed), 3))
      .add("clients", status.clients.size())
      .add("in_flight", status.in_flight)
      .add("valid", why.empty())
      .add("invalid_because", why)
      .add("overflowed", status.overflowed)
      .add("timer_floor_us", quantiles_json(status.timer_floor));
  if (status.scenario_steps > 0) {
    JsonLine scenario;
    scenario.add("steps", status.scenario_steps).add("done", status.scenario_done);
    json.add("scenario", scenario);
  }
  if (!status.no_socket.empty()) json.add("no_socket", status.no_socket);
  if (!status.last_change.empty()) json.add("last_change", status.last_change);
  json.add("up", direction_json(status.of(Direction::kUp))).add("down", direction_json(status.of(Direction::kDown)));
  return json;
}

}  // namespace tendon::injector
