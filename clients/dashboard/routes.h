// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "clients/cpp/web/http_server.h"
#include "clients/dashboard/operator.h"
#include "clients/dashboard/page_files.h"
#include "clients/dashboard/recordings.h"

namespace tendon::dash {

using web::Request;

struct Reply {  // without Date and Connection
  struct Slice {
    OpenFile file;
    ByteRange range;
  };
  unsigned status = 200;
  std::vector<std::pair<std::string, std::string>> headers{};
  std::variant<std::string, std::string_view, Slice> body{};

  std::uint64_t size() const;
  std::string head(bool keep_alive) const;  ///< status line and headers including the empty line
};

struct LiveSocket {};
struct BridgeSocket {
  bool local = false;  ///< allows unencrypted datagrams
};

struct FoxgloveSocket {
  std::string protocol;  ///< selected subprotocol
};

using Answer = std::variant<Reply, LiveSocket, BridgeSocket, FoxgloveSocket>;

/// Answers requests, without sockets. Contains all rules for access.
///
///     GET /                    the page; GET /assets/… its assets
///     GET /live                WebSocket: live data for the page
///     GET /bridge              WebSocket: datagrams
///     GET /foxglove            WebSocket: live data for Foxglove and Lichtblick
///     GET /metrics             for Prometheus
///     GET /api/recordings      list of recordings
///     GET /recordings/NAME     content of a recording; supports Range
///     POST /api/arm?device=N   starts arming; also disarm, engage and disengage; the result is sent over /live
///
/// Any page open in a browser on this machine could send these requests. Therefore:
///
/// * **Host** must name this machine (localhost, 127.0.0.1, [::1]) or one of Config::hosts. Other names, which may
///   result from DNS rebinding, receive 421.
/// * **Origin** of a WebSocket must be the same host for /live, the same host or one of Config::origins for /foxglove,
///   and a page on this machine or one of Config::origins for /bridge; otherwise 403. Programs other than browsers send
///   no Origin. Pages of other origins cannot read any reply, because no CORS header is sent.
/// * **Subprotocol** of /foxglove: the first requested one that is `foxglove.sdk.v1` or `foxglove.websocket.v1`, two
///   names for the same protocol; otherwise 400.
/// * **Orders** such as arming move a machine. They are accepted only from this page in a browser on this machine, and
///   refused (403) from other machines, through proxies, with another Origin, and without an Origin. A form or script
///   of another page cannot send the Origin of this page. Since the machine may have other users, `Authorization:
///   Bearer PASS` must contain the password printed at the start. 202: started; 409: refused, with the reason.
/// * All other paths only support GET and HEAD (405). Unknown paths receive 404. The only name that is looked up in a
///   file system is the plain name of a recording.
///
/// Thread-safe: no. Realtime-safe: no.
class Routes {
 public:
  struct Config {
    std::vector<std::string> hosts{};    ///< other names of this machine, with or without ":PORT"
    std::vector<std::string> origins{};  ///< origins that may use /bridge and /foxglove: "https://lab.example"
  };
  /// Sources of the replies. All must outlive the routes; `recordings` may be null.
  struct Sources {
    std::span<const PageFile> page;
    const Recordings* recordings = nullptr;
    std::function<std::string()> metrics;
    /// Starts an order. Returns why it cannot be started, otherwise an empty string. If not set, orders are refused.
    std::function<std::string(std::uint32_t device, Order order)> press{};
    std::string pass{};  ///< password for `press`; must consist of characters allowed in headers and URLs
  };

  Routes(Config config, Sources sources) : config_(std::move(config)), sources_(std::move(sources)) {}

  Answer answer(const Request& request) const;

  static Reply plain(unsigned status, std::string words, std::string_view allowed = "GET, HEAD");

 private:
  bool is_our_host(std::string_view host) const;
  bool is_foreign(const Request& request, std::string_view path) const;
  Reply order(const Request& request, std::string_view path, Order order) const;
  Reply file(const Request& request, std::string_view path) const;
  Reply recording(const Request& request, std::string_view name) const;

  Config config_;
  Sources sources_;
};

/// Decodes percent-encoding. Returns nullopt if it is invalid or contains a zero byte.
std::optional<std::string> percent_decoded(std::string_view text);

}  // namespace tendon::dash
