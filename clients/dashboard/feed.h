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

/// Distributes changes of the Board to all open pages. It has no socket: it consumes lines and produces texts. A page
/// watches one device, initially the first one. The line "watch N" selects device N. After "watch N beside", the page
/// also receives the newest state of each other device in every tick, for the 3-D view. In each tick, a page receives
/// the new states of its device and its coupling, and once per second the reports on the loop and the engines. Texts
/// are shared by all pages that watch the same device. Thread-safe: no. Realtime-safe: no.
class Feed {
 public:
  using PageId = std::uint64_t;
  static constexpr Duration kTick = std::chrono::microseconds(16'667);  ///< the refresh period of a screen
  static constexpr double kMaxLinesHz = 20;  ///< maximum number of lines per second from a page

  /// `board` and `counts` must outlive the feed.
  Feed(Board& board, Abilities abilities, WebCounts& counts, LocalTime now)
      : board_(board), abilities_(std::move(abilities)), counts_(counts), next_reports_(now) {}

  PageId join(LocalTime now);
  void leave(PageId page);
  std::size_t pages() const noexcept { return pages_.size(); }

  /// Handles a line from a page. Returns false if it is invalid or too frequent; the page should then be closed.
  bool receive(LocalTime now, PageId page, std::string_view line);
  void tick(LocalTime now);
  std::optional<std::string> next(PageId page);  ///< next text for a page, if any

 private:
  struct Page {
    std::uint32_t device = 0;
    bool beside = false;        ///< also send the other devices
    std::uint64_t version = 0;  ///< board version known to the page
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
