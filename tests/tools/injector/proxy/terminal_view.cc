// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/terminal_view.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <string_view>

namespace tendon::injector {
namespace {

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
std::string
format(const char* form, ...) {
  std::array<char, 512> text{};
  std::va_list arguments;
  va_start(arguments, form);
  std::vsnprintf(text.data(), text.size(), form, arguments);
  va_end(arguments);
  return text.data();
}

double ms(Duration d) { return static_cast<double>(d.count()) / 1e6; }
double in_us(Duration d) { return static_cast<double>(d.count()) / 1e3; }

const char* name_of(Direction direction) { return direction == Direction::kUp ? "up" : "down"; }

double percent(std::uint64_t count, std::uint64_t of) {
  return of == 0 ? 0 : 100 * static_cast<double>(count) / static_cast<double>(of);
}

std::string losses_by_cause(const ProxyCounters& n) {
  std::string text;
  for (std::size_t cause = 0; cause < kCauses; ++cause) {
    if (n.dropped[cause] == 0) continue;
    text += format("%s%s %llu", text.empty() ? "" : ", ", std::string(to_string(static_cast<Cause>(cause))).c_str(),
                   static_cast<unsigned long long>(n.dropped[cause]));
  }
  return text;
}

std::string other_fates(const ProxyCounters& n) {
  std::string text;
  const auto add = [&](const char* what, std::uint64_t count) {
    if (count > 0) text += format(", %llu %s", static_cast<unsigned long long>(count), what);
  };
  add("duplicated", n.duplicated);
  add("replayed", n.replayed);
  add("flipped", n.flipped);
  add("truncated", n.truncated);
  add("refused: too many clients", n.refused_clients);
  add("refused: memory full", n.refused_full);
  add("refused by the kernel", n.unsent);
  add("after the end of the trace", n.after_end);
  return text;
}

double rate_per_s(const Status& now, const Status& before, Direction direction) {
  const double elapsed = seconds(now.elapsed - before.elapsed);
  const std::uint64_t count = now.of(direction).counters.received - before.of(direction).counters.received;
  return elapsed > 0 ? static_cast<double>(count) / elapsed : 0;
}

/// Cuts to `columns` characters (not bytes).
std::string cut(std::string_view line, std::size_t columns) {
  std::size_t characters = 0;
  std::size_t bytes = 0;
  while (bytes < line.size()) {
    if ((static_cast<unsigned char>(line[bytes]) & 0xc0) != 0x80 && ++characters > columns) break;
    ++bytes;
  }
  return std::string(line.substr(0, bytes));
}

}  // namespace

std::string terminal_view(const Heading& heading, const Status& now, const Status& before, const std::string& typed,
                          std::size_t columns) {
  std::vector<std::string> lines;
  const std::vector<std::string> why = why_invalid(now, heading.max_release_error);
  lines.push_back(format("tendon-inject  %s -> %s   seed %llu   %.0f s   %zu client%s   %zu in flight",
                         heading.listen.c_str(), heading.server.c_str(), static_cast<unsigned long long>(heading.seed),
                         seconds(now.elapsed), now.clients.size(), now.clients.size() == 1 ? "" : "s", now.in_flight));
  lines.emplace_back();
  lines.emplace_back("          rate    one-way delay, ms                 lost    twice   released late, µs");
  lines.emplace_back("           1/s      p50      p95      p99      max      %        %      p50     p99      max");
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    const ProxyMeasurements& all = now.of(direction);
    const ProxyMeasurements& old = before.of(direction);
    const DurationHistogram delay = all.delay.since(old.delay);
    const DurationHistogram late = all.release_error.since(old.release_error);
    const std::uint64_t received = all.counters.received - old.counters.received;
    lines.push_back(format("%-6s %7.0f %8.2f %8.2f %8.2f %8.2f %6.2f   %6.2f   %6.0f  %6.0f   %6.0f",
                           name_of(direction), rate_per_s(now, before, direction), ms(delay.quantile(0.5)),
                           ms(delay.quantile(0.95)), ms(delay.quantile(0.99)), ms(delay.max()),
                           percent(all.counters.lost() - old.counters.lost(), received),
                           percent(all.counters.duplicated - old.counters.duplicated, received),
                           in_us(late.quantile(0.5)), in_us(late.quantile(0.99)), in_us(late.max())));
  }
  lines.push_back(format("%-65s%6.0f  %6.0f   %6.0f", "timer of this machine, for comparison",
                         in_us(now.timer_floor.quantile(0.5)), in_us(now.timer_floor.quantile(0.99)),
                         in_us(now.timer_floor.max())));
  lines.emplace_back();
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    const ProxyCounters& n = now.of(direction).counters;
    const std::string by_cause = losses_by_cause(n);
    lines.push_back(format("%-6s %llu in, %llu lost%s%s", name_of(direction),
                           static_cast<unsigned long long>(n.received), static_cast<unsigned long long>(n.lost()),
                           by_cause.empty() ? "" : (" (" + by_cause + ")").c_str(), other_fates(n).c_str()));
    lines.push_back("       " + heading.profiles[static_cast<std::size_t>(direction)]);
  }
  if (now.scenario_steps > 0)
    lines.push_back(format("scenario: %zu of %zu changes", now.scenario_done, now.scenario_steps));
  if (!now.last_change.empty()) lines.push_back("last change: " + now.last_change);
  constexpr std::size_t kMaxClients = 8;  // lines
  for (std::size_t i = 0; i < std::min(now.clients.size(), kMaxClients); ++i) {
    const Proxy::ClientSummary& client = now.clients[i];
    lines.push_back(format("client %u: %s, %llu up, %llu down", client.index, to_string(client.address).c_str(),
                           static_cast<unsigned long long>(client.received[0]),
                           static_cast<unsigned long long>(client.received[1])));
  }
  if (now.clients.size() > kMaxClients) lines.push_back(format("… and %zu more", now.clients.size() - kMaxClients));
  for (const std::string& reason : why) lines.push_back("INVALID: " + reason);
  lines.emplace_back();
  lines.push_back("> " + typed);
  std::string view;
  for (const std::string& line : lines) view += (view.empty() ? "" : "\n") + cut(line, columns);
  return view;
}

std::string log_line(const Status& now, const Status& before) {
  std::string line =
      format("%6.1f s: %zu client%s", seconds(now.elapsed), now.clients.size(), now.clients.size() == 1 ? "" : "s");
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    const ProxyMeasurements& all = now.of(direction);
    const ProxyMeasurements& old = before.of(direction);
    const DurationHistogram delay = all.delay.since(old.delay);
    line += format("; %s %.0f/s, %.2f ms (p99 %.2f), %.2f %% lost, late p99 %.0f us", name_of(direction),
                   rate_per_s(now, before, direction), ms(delay.quantile(0.5)), ms(delay.quantile(0.99)),
                   percent(all.counters.lost() - old.counters.lost(), all.counters.received - old.counters.received),
                   in_us(all.release_error.since(old.release_error).quantile(0.99)));
  }
  return line;
}

std::string end_text(const Heading& heading, const Status& end) {
  std::string text = format("after %.1f s, seed %llu, %zu still in flight\n", seconds(end.elapsed),
                            static_cast<unsigned long long>(heading.seed), end.in_flight);
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    const ProxyMeasurements& measured = end.of(direction);
    const ProxyCounters& n = measured.counters;
    const std::string by_cause = losses_by_cause(n);
    text += format("  %-6s %llu in, %llu forwarded, %llu lost%s%s\n", (name_of(direction) + std::string(":")).c_str(),
                   static_cast<unsigned long long>(n.received), static_cast<unsigned long long>(n.forwarded),
                   static_cast<unsigned long long>(n.lost()), by_cause.empty() ? "" : (" (" + by_cause + ")").c_str(),
                   other_fates(n).c_str());
    const auto quantiles = [&](const char* what, const DurationHistogram& of, double (*unit)(Duration),
                               const char* name) {
      return format("         %s p50 %.2f, p99 %.2f, max %.2f %s\n", what, unit(of.quantile(0.5)),
                    unit(of.quantile(0.99)), unit(of.max()), name);
    };
    text += quantiles("one-way delay", measured.delay, ms, "ms");
    text += quantiles("released late by", measured.release_error, in_us, "us");
    if (measured.played > 0) text += format("         played %s times\n", played_text(measured.played).c_str());
  }
  text += format("  the timer of this machine was late by p50 %.2f, p99 %.2f, max %.2f us (n = %llu)\n",
                 in_us(end.timer_floor.quantile(0.5)), in_us(end.timer_floor.quantile(0.99)),
                 in_us(end.timer_floor.max()), static_cast<unsigned long long>(end.timer_floor.count()));
  const std::vector<std::string> why = why_invalid(end, heading.max_release_error);
  for (const std::string& reason : why) text += "  INVALID: " + reason + "\n";
  if (why.empty()) text += "  valid: the network was simulated exactly\n";
  return text;
}

}  // namespace tendon::injector
