// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/feed.h"

#include <algorithm>
#include <charconv>
#include <span>
#include <utility>
#include <vector>

#include "protocol/limits.h"

namespace tendon::dash {
namespace {

constexpr Duration kReportsEvery = std::chrono::seconds(1);
constexpr std::string_view kBeside = " beside";

std::optional<std::uint32_t> number_after(std::string_view line, std::string_view word) {
  if (!line.starts_with(word)) return std::nullopt;
  line.remove_prefix(word.size());
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
  if (error != std::errc{} || end != line.data() + line.size() || number >= limits::kMaxDevices) return std::nullopt;
  return number;
}

}  // namespace

Feed::PageId Feed::join(LocalTime now) {
  const std::uint32_t first = board_.devices().empty() ? 0 : board_.devices().begin()->first;
  pages_.emplace(++last_, Page{.device = first, .post = {}, .lines = RateLimit(kMaxLinesHz, now)});
  counts_.pages = pages_.size();
  return last_;
}

void Feed::leave(PageId page) {
  pages_.erase(page);
  counts_.pages = pages_.size();
}

bool Feed::receive(LocalTime now, PageId id, std::string_view line) {
  const auto found = pages_.find(id);
  if (found == pages_.end()) return false;
  Page& page = found->second;
  if (!page.lines.take(now)) return false;
  const bool beside = line.ends_with(kBeside);
  if (beside) line.remove_suffix(kBeside.size());
  const auto device = number_after(line, "watch ");
  if (!device) return false;
  page.beside = beside;
  if (page.device != *device) page.post.forget_states();
  page.device = *device;
  page.reports_due = true;
  return true;
}

void Feed::tick(LocalTime now) {
  const bool reports = now >= next_reports_;
  if (reports) next_reports_ = std::max(next_reports_ + kReportsEvery, now);
  std::map<std::uint32_t, std::string> reports_of;
  std::optional<std::string> server;
  for (auto& [id, page] : pages_) {
    if (page.version != board_.version()) {
      if (!server) server = server_json(board_, abilities_);
      page.post.put(PagePost::Kind::kServer, *server);
      page.version = board_.version();
    }
    if (std::exchange(page.reports_due, false) || reports) {
      auto& text = reports_of[page.device];
      if (text.empty()) text = reports_json(page.device, board_);
      page.post.put(PagePost::Kind::kReports, text);
    }
  }
  std::vector<std::uint32_t> devices;
  for (const auto& [number, device] : board_.devices()) devices.push_back(number);
  for (const std::uint32_t number : devices) {
    const std::vector<Board::Ports> ports = board_.take_ports(number);
    std::string both;
    for (auto& [id, page] : pages_) {
      if (page.device != number || ports.empty()) continue;
      if (both.empty()) both = ports_json(number, ports);
      page.post.put(PagePost::Kind::kPorts, both);
    }
    const std::vector<DeviceState> states = board_.take_states(number);
    if (states.empty()) continue;
    std::string text;
    std::string newest;
    for (auto& [id, page] : pages_) {
      if (page.device != number && !page.beside) continue;
      if (page.device != number) {
        if (newest.empty()) newest = states_json(number, std::span(states).last(1));
        page.post.put_beside(number, newest);
        continue;
      }
      if (text.empty()) text = states_json(number, states);
      page.post.put_states(text, states.size());
      counts_.states_skipped += page.post.take_skipped();
    }
  }
}

std::optional<std::string> Feed::next(PageId page) {
  const auto found = pages_.find(page);
  return found == pages_.end() ? std::nullopt : found->second.post.next();
}

}  // namespace tendon::dash
