// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/routes.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <type_traits>

#include "clients/cpp/web/origin.h"
#include "clients/dashboard/page_json.h"
#include "protocol/secrets/crypto.h"

namespace tendon::dash {
namespace {

/// Allows only scripts, styles and connections of the page itself, and no embedding. The icon is a data: image.
constexpr std::string_view kContentSecurity =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

struct OrderPath {
  std::string_view path;
  Order order;
};
constexpr OrderPath kOrders[] = {{"/api/arm", Order::kArm},
                                 {"/api/disarm", Order::kDisarm},
                                 {"/api/engage", Order::kEngage},
                                 {"/api/disengage", Order::kDisengage}};

constexpr std::string_view kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

struct StatusWords {
  unsigned status;
  std::string_view words;
};
constexpr StatusWords kStatusWords[] = {{200, "OK"},
                                        {202, "Accepted"},
                                        {206, "Partial Content"},
                                        {400, "Bad Request"},
                                        {403, "Forbidden"},
                                        {404, "Not Found"},
                                        {405, "Method Not Allowed"},
                                        {409, "Conflict"},
                                        {413, "Content Too Large"},
                                        {416, "Range Not Satisfiable"},
                                        {421, "Misdirected Request"},
                                        {426, "Upgrade Required"},
                                        {431, "Request Header Fields Too Large"},
                                        {503, "Service Unavailable"}};

/// Returns the first supported subprotocol in the list, or an empty string. Case-sensitive.
std::string foxglove_protocol(std::string_view list) {
  while (!list.empty()) {
    const auto comma = list.find(',');
    std::string_view name = list.substr(0, comma);
    list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
    const auto begin = std::min(name.find_first_not_of(" \t"), name.size());
    name.remove_prefix(begin);
    name = name.substr(0, name.find_last_not_of(" \t") + 1);
    if (name == "foxglove.sdk.v1" || name == "foxglove.websocket.v1") return std::string(name);
  }
  return {};
}

void set(Reply& reply, std::string_view name, std::string_view value) { reply.headers.emplace_back(name, value); }

Reply begin(unsigned status, std::string_view type) {
  Reply reply;
  reply.status = status;
  set(reply, "Content-Type", type);
  set(reply, "Content-Security-Policy", kContentSecurity);
  set(reply, "Cross-Origin-Opener-Policy", "same-origin");
  set(reply, "Cross-Origin-Resource-Policy", "same-origin");
  set(reply, "Referrer-Policy", "no-referrer");
  set(reply, "X-Content-Type-Options", "nosniff");
  return reply;
}

}  // namespace

std::uint64_t Reply::size() const {
  return std::visit(
      [](const auto& content) -> std::uint64_t {
        if constexpr (std::is_same_v<std::decay_t<decltype(content)>, Slice>) {
          return content.range.count;
        } else {
          return content.size();
        }
      },
      body);
}

std::string Reply::head(bool keep_alive) const {
  const auto* const words = std::ranges::find(kStatusWords, status, &StatusWords::status);
  std::string text = "HTTP/1.1 " + std::to_string(status) + " " +
                     std::string(words != std::end(kStatusWords) ? words->words : "Status") + "\r\n";
  for (const auto& [name, value] : headers) text += name + ": " + value + "\r\n";
  text += "Content-Length: " + std::to_string(size()) + "\r\n";
  text += keep_alive ? "Connection: keep-alive\r\n\r\n" : "Connection: close\r\n\r\n";
  return text;
}

std::optional<std::string> percent_decoded(std::string_view text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      unsigned value = 0;
      const std::string_view hex = text.substr(i + 1, 2);
      const auto [end, error] = std::from_chars(hex.data(), hex.data() + hex.size(), value, 16);
      if (hex.size() != 2 || error != std::errc{} || end != hex.data() + 2) return std::nullopt;
      c = static_cast<char>(static_cast<unsigned char>(value));
      i += 2;
    }
    if (c == '\0') return std::nullopt;
    bytes += c;
  }
  return bytes;
}

Reply Routes::plain(unsigned status, std::string words, std::string_view allowed) {
  Reply reply = begin(status, "text/plain; charset=utf-8");
  set(reply, "Cache-Control", "no-store");
  if (status == 405) set(reply, "Allow", allowed);
  reply.body = std::move(words) + "\n";
  return reply;
}

bool Routes::is_our_host(std::string_view host) const {
  const std::string_view name = web::host_name(host);
  if (name.empty()) return false;
  return web::is_loopback_name(name) || std::ranges::any_of(config_.hosts, [&](const std::string& ours) {
           return web::equal_but_for_case(ours, host) || web::equal_but_for_case(ours, name);
         });
}

bool Routes::is_foreign(const Request& request, std::string_view path) const {
  if (!request.origin) return false;
  if (path == "/bridge") return !web::may_come_from(*request.origin, config_.origins);
  if (path == "/foxglove" && std::ranges::find(config_.origins, *request.origin) != config_.origins.end()) return false;
  return !web::equal_but_for_case(web::origin_host(*request.origin), *request.host);
}

Reply Routes::order(const Request& request, std::string_view path, Order order) const {
  if (request.method != "POST") return plain(405, "only POST", "POST");
  if (!request.host || !is_our_host(*request.host)) {
    return plain(421, "unknown host name; see --host of tendon-dash");
  }
  if (!request.local || request.proxied)
    return plain(403, "Only accepted from the machine on which tendon-dash is running.");
  if (!request.origin || !web::equal_but_for_case(web::origin_host(*request.origin), *request.host)) {
    return plain(403, "Only accepted from the page of tendon-dash.");
  }
  if (!sources_.press) return plain(403, std::string(kArmingNeeds));
  const auto bytes = [](std::string_view text) { return std::as_bytes(std::span(text)); };
  if (!request.authorization || !crypto::equal(bytes(*request.authorization), bytes("Bearer " + sources_.pass))) {
    return plain(403,
                 "Only accepted from the address that tendon-dash prints at the start: the token is missing, or from "
                 "another run.");
  }
  constexpr std::string_view kQuery = "?device=";
  std::string_view rest = request.target.substr(path.size());
  std::uint32_t device = 0;
  const bool named = rest.starts_with(kQuery);
  if (named) rest.remove_prefix(kQuery.size());
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), device);
  if (!named || error != std::errc{} || end != rest.data() + rest.size()) return plain(400, "expected ?device=N");
  const std::string objection = sources_.press(device, order);
  return objection.empty() ? plain(202, "begun") : plain(409, objection);
}

Answer Routes::answer(const Request& request) const {
  const std::string_view path = request.target.substr(0, request.target.find('?'));
  const auto* const ordered = std::ranges::find(kOrders, path, &OrderPath::path);
  if (ordered != std::end(kOrders)) return order(request, path, ordered->order);
  if (request.method != "GET" && request.method != "HEAD") return plain(405, "only GET and HEAD are supported");
  if (!request.host || !is_our_host(*request.host)) {
    return plain(421, "unknown host name; see --host of tendon-dash");
  }
  if (path == "/live" || path == "/bridge" || path == "/foxglove") {
    if (is_foreign(request, path)) {
      return plain(403,
                   "pages from this origin are not accepted; see --origin of tendon-dash for /bridge and /foxglove");
    }
    if (!request.upgrade) return plain(426, "expected a WebSocket request");
    if (path == "/live") return LiveSocket{};
    if (path == "/bridge") return BridgeSocket{request.local && !request.proxied};
    std::string protocol = foxglove_protocol(request.protocols);
    if (protocol.empty()) return plain(400, "expected the subprotocol foxglove.sdk.v1 or foxglove.websocket.v1");
    return FoxgloveSocket{std::move(protocol)};
  }
  if (path == "/metrics") {
    Reply reply = begin(200, kMetricsType);
    set(reply, "Cache-Control", "no-store");
    reply.body = sources_.metrics();
    return reply;
  }
  if (path == "/api/recordings") {
    Reply reply = begin(200, "application/json");
    set(reply, "Cache-Control", "no-store");
    const auto entries =
        sources_.recordings != nullptr ? sources_.recordings->list() : std::vector<Recordings::Entry>();
    reply.body = recordings_json(entries);
    return reply;
  }
  constexpr std::string_view kRecordings = "/recordings/";
  if (path.starts_with(kRecordings)) return recording(request, path.substr(kRecordings.size()));
  return file(request, path == "/" ? "/index.html" : path);
}

Reply Routes::file(const Request& request, std::string_view path) const {
  const auto found = std::ranges::find(sources_.page, path, &PageFile::path);
  if (found == sources_.page.end()) return plain(404, "not found");
  Reply reply = begin(200, found->type);
  // Asset names contain a hash of their content.
  set(reply, "Cache-Control", path.starts_with("/assets/") ? "public, max-age=31536000, immutable" : "no-cache");
  set(reply, "Vary", "Accept-Encoding");
  const bool gzip = request.accept_encoding.find("gzip") != std::string_view::npos && !found->gzip.empty();
  if (gzip) set(reply, "Content-Encoding", "gzip");
  reply.body = gzip ? found->gzip : found->bytes;
  return reply;
}

Reply Routes::recording(const Request& request, std::string_view name) const {
  const auto decoded = percent_decoded(name);
  auto opened = decoded && sources_.recordings != nullptr ? sources_.recordings->open(*decoded) : std::nullopt;
  if (!opened) return plain(404, "no such recording");
  const std::uint64_t size = opened->size();
  const auto range = request.range ? parse_range(*request.range, size) : WholeFile{};
  if (std::holds_alternative<Unsatisfiable>(range)) {
    Reply reply = plain(416, "the range is beyond the end of the file");
    set(reply, "Content-Range", "bytes */" + std::to_string(size));
    return reply;
  }
  const auto* part = std::get_if<ByteRange>(&range);
  Reply reply = begin(part != nullptr ? 206 : 200, "application/octet-stream");
  set(reply, "Cache-Control", "no-store");
  set(reply, "Accept-Ranges", "bytes");
  const ByteRange slice = part != nullptr ? *part : ByteRange{0, size};
  if (part != nullptr) {
    set(reply, "Content-Range",
        "bytes " + std::to_string(slice.first) + "-" + std::to_string(slice.first + slice.count - 1) + "/" +
            std::to_string(size));
  }
  reply.body = Reply::Slice{std::move(*opened), slice};
  return reply;
}

}  // namespace tendon::dash
