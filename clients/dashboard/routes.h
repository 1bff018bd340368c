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

#include "clients/dashboard/operator.h"
#include "clients/dashboard/page_files.h"
#include "clients/dashboard/recordings.h"

namespace tendon::dash {

/// The parts of an HTTP request that matter here. The texts belong to the caller.
struct Request {
  std::string_view method;
  std::string_view target;                 ///< path and query, as it came
  std::optional<std::string_view> host{};  ///< header Host
  std::optional<std::string_view> origin{};
  std::optional<std::string_view> authorization{};
  std::optional<std::string_view> range{};
  std::string_view accept_encoding{};
  bool upgrade = false;     ///< asks for a WebSocket …
  std::string protocols{};  ///< … of one of these: Sec-WebSocket-Protocol, several joined by commas
  bool local = false;       ///< from an address of this machine …
  bool proxied = false;     ///< … but passed on by a proxy: Forwarded, X-Forwarded-For, X-Real-IP or Via
};

/// An answer: everything but Date and Connection.
struct Reply {
  struct Slice {
    OpenFile file;
    ByteRange range;
  };
  unsigned status = 200;
  std::vector<std::pair<std::string, std::string>> headers{};
  std::variant<std::string, std::string_view, Slice> body{};

  std::uint64_t size() const;
  /// Status line and headers, with the empty line; `keep_alive`: the connection stays.
  std::string head(bool keep_alive) const;
};

/// The connection becomes a WebSocket.
struct LiveSocket {};
struct BridgeSocket {
  bool local = false;  ///< datagrams in the clear may pass
};

struct FoxgloveSocket {
  std::string protocol;  ///< one of those that were asked for
};

using Answer = std::variant<Reply, LiveSocket, BridgeSocket, FoxgloveSocket>;

/// Answers requests, without a socket. All rules about who may see or do what are here.
///
///     GET /                    the page, GET /assets/… its parts
///     GET /live                WebSocket: what the server does now
///     GET /bridge              WebSocket: datagrams
///     GET /foxglove            WebSocket: the same as /live for Foxglove and Lichtblick, in their protocol
///     GET /metrics             for Prometheus
///     GET /api/recordings      the list of recordings
///     GET /recordings/NAME     the bytes of one; Range is understood
///     POST /api/arm?device=N   begins it, as disarm, engage and disengage; /live tells the result
///
/// Any page that is open in a browser on this machine could send these requests. Therefore:
/// * **Host** must name this machine (localhost, 127.0.0.1, [::1]) or one of Config::hosts. Another name that has been
///   made to point here (DNS rebinding) is refused: 421.
/// * **Origin** of a WebSocket must be that same host for /live, that host or one of Config::origins for /foxglove, and
///   a page of this machine or one of Config::origins for /bridge; otherwise 403. A program that is no browser sends no
///   Origin. Other origins cannot read anything else, because no CORS header is ever sent.
/// * **Subprotocol** of /foxglove: the first one asked for that is `foxglove.sdk.v1` or `foxglove.websocket.v1`, which
///   are one protocol with two names; where neither is asked for, 400.
/// * **Arming**, like the other three orders, moves a machine, so only this page in a browser on this machine may do
/// it;
///   otherwise 403. It is refused from another machine, through a proxy, with another Origin, and from a program that
///   sends no Origin. A form or a script of another page cannot send this page's Origin. Other people may use this
///   machine too, so `Authorization: Bearer PASS` must have the pass that was printed for the person who started the
///   program. 202: begun; 409: not now, with the reason.
/// * Everything else takes GET and HEAD only: 405. A path that is not listed above is 404. The only name that is looked
///   up in a file system is the plain name of a recording.
///
/// Thread-safe: no. Realtime-safe: no.
class Routes {
 public:
  struct Config {
    std::vector<std::string> hosts{};  ///< other names of this machine, with ":PORT" or without
    /// Pages from there may use /bridge and /foxglove: "https://lab.example".
    std::vector<std::string> origins{};
  };
  /// Where the answers come from. All must outlive the routes; `recordings` may be null.
  struct Sources {
    std::span<const PageFile> page;
    const Recordings* recordings = nullptr;
    std::function<std::string()> metrics;
    /// Begins an order. Returns why it does not begin; an empty string when it does. A function that is not set: nobody
    /// may arm.
    std::function<std::string(std::uint32_t device, Order order)> press{};
    std::string pass{};  ///< for `press`; only characters that a header and an address may have
  };

  Routes(Config config, Sources sources) : config_(std::move(config)), sources_(std::move(sources)) {}

  Answer answer(const Request& request) const;

  /// An answer in plain words: a refusal or an error.
  static Reply plain(unsigned status, std::string words, std::string_view allowed = "GET, HEAD");

 private:
  bool is_our_host(std::string_view host) const;
  bool is_our_origin(std::string_view origin) const;
  bool is_foreign(const Request& request, std::string_view path) const;
  Reply order(const Request& request, std::string_view path, Order order) const;
  Reply file(const Request& request, std::string_view path) const;
  Reply recording(const Request& request, std::string_view name) const;

  Config config_;
  Sources sources_;
};

/// The bytes that a percent-encoded text stands for; empty when the encoding is wrong or holds a zero byte.
std::optional<std::string> percent_decoded(std::string_view text);

}  // namespace tendon::dash
