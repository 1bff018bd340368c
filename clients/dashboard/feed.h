// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "clients/dashboard/board.h"
#include "clients/dashboard/metrics.h"
#include "clients/dashboard/page_json.h"
#include "clients/dashboard/page_post.h"
#include "clients/dashboard/rate_limit.h"

namespace tendon::dash {

/// Tells every open page the news of the Board. It has no socket: lines from a page go in, texts for it come out.
///
/// A page watches one device, at first the server's first one. The line "watch N" changes to device N; with "watch N
/// beside" the page also gets the newest state of each other device, once a tick: the 3-D view shows all of them.
///
/// Every tick the page gets the new states of its device and of its coupling, and once a second the reports on the loop
/// and the engines. Each text is made once for all pages that watch the same device.
///
/// Thread-safe: no. Realtime-safe: no.
class Feed {
 public:
  using PageId = std::uint64_t;
  /// Between two ticks: a screen's refresh period.
  static constexpr Duration kTick = std::chrono::microseconds(16'667);
  /// Lines that a page may send in a second: a person clicks less often.
  static constexpr double kMaxLinesHz = 20;

  /// `board` and `counts` must outlive the feed.
  Feed(Board& board, Abilities abilities, WebCounts& counts, LocalTime now)
      : board_(board), abilities_(std::move(abilities)), counts_(counts), next_reports_(now) {}

  PageId join(LocalTime now);
  void leave(PageId page);
  std::size_t pages() const noexcept { return pages_.size(); }

  /// Takes a line of a page. False when it is not understood, or came too fast: the page should then be closed.
  bool hear(LocalTime now, PageId page, std::string_view line);
  /// Takes what is new on the board.
  void tick(LocalTime now);
  /// The next text for a page; empty when none waits.
  std::optional<std::string> next(PageId page);

 private:
  struct Page {
    std::uint32_t device = 0;
    bool beside = false;        ///< the other devices too
    std::uint64_t version = 0;  ///< the board's version that the page knows
    bool reports_due = true;
    PagePost post;
    RateLimit lines;
  };

  Board& board_;
  Abilities abilities_;
  WebCounts& counts_;
  LocalTime next_reports_;
  PageId last_ = 0;
  std::map<PageId, Page> pages_;
};

}  // namespace tendon::dash
