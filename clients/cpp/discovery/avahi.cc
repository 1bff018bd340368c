// SPDX-License-Identifier: Apache-2.0
// Avahi over D-Bus (org.freedesktop.Avahi.Server.xml and ServiceBrowser.xml of Avahi 0.8).
#include <systemd/sd-bus.h>
#include <systemd/sd-event.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <ctime>
#include <map>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "clients/cpp/discovery/discovery.h"

namespace tendon::dns_sd {
namespace {

constexpr const char* kAvahi = "org.freedesktop.Avahi";
constexpr const char* kServer = "org.freedesktop.Avahi.Server";
constexpr const char* kServiceBrowser = "org.freedesktop.Avahi.ServiceBrowser";
constexpr int kAny = -1;  ///< any interface or protocol
constexpr int kIpv4 = 0;
constexpr int kIpv6 = 1;
constexpr unsigned kNoAddress = 8;  ///< AVAHI_LOOKUP_NO_ADDRESS

// µs. Avahi repeats queries after 1 and 3 s, so that the loss of one query does not matter.
constexpr std::uint64_t kResolveFor = 3'000'000;
constexpr std::uint64_t kBrowseFor = 4'000'000;
/// Avahi reports "all for now" one second after the first query. With many answers, or after losses, more arrive
/// later; a list is complete if nothing arrives for this time.
constexpr std::uint64_t kQuiet = 1'000'000;
/// Wait after the first address, because a host with IPv4 and IPv6 answers over both immediately.
constexpr std::uint64_t kOtherAddress = 200'000;

constexpr std::size_t kMaxFound = 4096;  ///< limit, because any host on the link can announce services

struct Release {
  void operator()(sd_event* loop) const { sd_event_unref(loop); }
  void operator()(sd_bus* bus) const { sd_bus_close_unref(bus); }
};

int end_loop(sd_event_source* source, std::uint64_t /*at*/, void* /*unused*/) {
  return sd_event_exit(sd_event_source_get_event(source), 0);
}

/// A synchronous Avahi query with a deadline.
class Conversation {
 public:
  Conversation(std::string what, std::uint64_t longest) : what_(std::move(what)) {
    sd_event* loop = nullptr;
    expect(sd_event_new(&loop), "cannot create an event loop");
    loop_.reset(loop);
    sd_bus* bus = nullptr;
    expect(sd_bus_open_system(&bus), "there is no D-Bus system bus");
    bus_.reset(bus);
    expect(sd_bus_attach_event(bus, loop, 0), "cannot create an event loop");
    end_after(longest);
  }

  void end_after(std::uint64_t microseconds) { call_after(microseconds, end_loop, nullptr); }
  void call_after(std::uint64_t microseconds, sd_event_time_handler_t handler, void* self) {
    if (sd_event_add_time_relative(loop_.get(), nullptr, CLOCK_MONOTONIC, microseconds, 1000, handler, self) < 0) end();
  }
  void end() noexcept { sd_event_exit(loop_.get(), 0); }

  template <class... Values>
  void call(sd_bus_message_handler_t answered, void* self, const char* method, const char* types, Values... values) {
    asked(
        sd_bus_call_method_async(bus_.get(), nullptr, kAvahi, "/", kServer, method, answered, self, types, values...));
  }
  void listen(const char* interface, sd_bus_message_handler_t heard, void* self) {
    asked(sd_bus_match_signal_async(bus_.get(), nullptr, kAvahi, nullptr, interface, nullptr, heard, nullptr, self));
  }

  /// Runs until end() or the deadline. Throws the error kept by refused().
  void run() {
    expect(sd_event_loop(loop_.get()), "the event loop has failed");
    if (!refusal_.empty()) throw std::runtime_error(refusal_);
  }

  /// Keeps the error for run(), unless it reports that no host answered.
  void refused(sd_bus_message* answer) {
    const sd_bus_error* error = sd_bus_message_get_error(answer);
    const std::string_view name = error->name;
    if (name == "org.freedesktop.Avahi.TimeoutError") return;
    const bool absent = name.starts_with("org.freedesktop.DBus.Error.");
    refuse(absent ? "avahi-daemon does not respond" : "avahi-daemon refused the request",
           error->message != nullptr ? error->message : error->name);
    end();
  }

 private:
  void refuse(const char* problem, const std::string& why) {
    refusal_ = "cannot search for " + what_ + ": " + problem + " (" + why +
               "). Expected a running avahi-daemon, or HOST:PORT instead of a name";
  }

  void expect(int result, const char* problem) {
    if (result >= 0) return;
    refuse(problem, std::generic_category().message(-result));
    throw std::runtime_error(refusal_);
  }

  /// Like expect(), for callbacks of libsystemd, which exceptions must not cross.
  void asked(int result) {
    if (result >= 0) return;
    refuse("the connection to the D-Bus system bus was lost", std::generic_category().message(-result));
    end();
  }

  std::string what_;
  std::string refusal_;
  std::unique_ptr<sd_event, Release> loop_;
  std::unique_ptr<sd_bus, Release> bus_;
};

std::vector<std::string> read_strings(sd_bus_message* message) {
  std::vector<std::string> strings;
  if (sd_bus_message_enter_container(message, 'a', "ay") < 0) return strings;
  const void* bytes = nullptr;
  std::size_t size = 0;
  while (sd_bus_message_read_array(message, 'y', &bytes, &size) > 0) {
    strings.emplace_back(static_cast<const char*>(bytes), size);
  }
  sd_bus_message_exit_container(message);
  return strings;
}

bool is_link_local(const Address& address) { return address.ip[0] == 0xFE && (address.ip[1] & 0xC0U) == 0x80U; }

void read_service(sd_bus_message* answer, Found& found) {
  const char* host = nullptr;
  const char* ip = nullptr;
  std::uint16_t port = 0;
  if (sd_bus_message_skip(answer, "iisss") < 0 || sd_bus_message_read(answer, "sisq", &host, nullptr, &ip, &port) < 0) {
    return;
  }
  found.host = is_domain(host) ? host : "";
  found.port = port;
  found.about = read_txt(read_strings(answer));
  const std::string text = ip;
  if (text.empty()) return;
  try {
    const Address address =
        parse_address((text.find(':') == std::string::npos ? text : "[" + text + "]") + ":" + std::to_string(port));
    // Link-local addresses cannot be used without an interface.
    if (is_link_local(address)) return;
    found.addresses.insert(is_ipv4(address) ? found.addresses.begin() : found.addresses.end(), address);
  } catch (const std::invalid_argument&) {
    return;
  }
}

class Resolution {
 public:
  explicit Resolution(const Instance& instance)
      : what_("dns-sd:" + to_string(instance)), avahi_(what_, kResolveFor), found_{.instance = instance} {
    // By default, Avahi does not publish IPv4 addresses over IPv6 (publish-a-on-ipv6), so each family is queried over
    // itself.
    for (const int family : {kIpv4, kIpv6}) {
      avahi_.call(answered, this, "ResolveService", "iisssiu", kAny, family, instance.name.c_str(), kService, kLocal,
                  family, 0U);
    }
  }

  Found run() {
    avahi_.run();
    if (found_.addresses.empty()) {
      throw std::runtime_error("cannot find " + what_ + ": no reply on this network for " + full_name(found_.instance) +
                               ". Use --server dns-sd: to list all devices");
    }
    return std::move(found_);
  }

 private:
  static int answered(sd_bus_message* answer, void* self, sd_bus_error* /*unused*/) noexcept {
    static_cast<Resolution*>(self)->answered(answer);
    return 0;
  }

  void answered(sd_bus_message* answer) {
    const bool first = found_.addresses.empty();
    if (sd_bus_message_is_method_error(answer, nullptr) > 0) {
      avahi_.refused(answer);
    } else {
      read_service(answer, found_);
    }
    if (--open_ == 0) return avahi_.end();
    if (first && !found_.addresses.empty()) avahi_.end_after(kOtherAddress);
  }

  std::string what_;
  Conversation avahi_;
  Found found_;
  int open_ = 2;  ///< pending queries
};

class Browsing {
 public:
  Browsing() : avahi_(std::string("dns-sd: (") + kService + ")", kBrowseFor) {
    avahi_.listen(kServiceBrowser, heard, this);  // before the browser exists, so that no signal is missed
    avahi_.call(begun, this, "ServiceBrowserNew", "iissu", kAny, kAny, kService, kLocal, 0U);
  }

  std::vector<Found> run() {
    avahi_.run();
    std::vector<Found> all;
    for (auto& [name, one] : found_) all.push_back(std::move(one.found));
    return all;
  }

 private:
  /// State of one instance. Its address must not change, since callbacks of Avahi refer to it.
  struct One {
    Browsing* all;
    Found found;
  };

  static int begun(sd_bus_message* answer, void* self, sd_bus_error* /*unused*/) noexcept {
    if (sd_bus_message_is_method_error(answer, nullptr) > 0) static_cast<Browsing*>(self)->avahi_.refused(answer);
    return 0;
  }

  static int heard(sd_bus_message* signal, void* self, sd_bus_error* /*unused*/) noexcept {
    auto& browsing = *static_cast<Browsing*>(self);
    const std::string_view what = sd_bus_message_get_member(signal);
    if (what == "ItemNew") browsing.add(signal);
    if (what == "AllForNow") browsing.watch();
    return 0;
  }

  static int watched(sd_event_source* /*unused*/, std::uint64_t /*at*/, void* self) noexcept {
    auto& browsing = *static_cast<Browsing*>(self);
    if (browsing.open_ > 0 || browsing.watched_ < browsing.found_.size()) {
      browsing.watch();
    } else {
      browsing.avahi_.end();
    }
    return 0;
  }

  void watch() {
    watched_ = found_.size();
    avahi_.call_after(kQuiet, watched, this);
  }

  static int described(sd_bus_message* answer, void* of, sd_bus_error* /*unused*/) noexcept {
    One& one = *static_cast<One*>(of);
    if (sd_bus_message_is_method_error(answer, nullptr) == 0) read_service(answer, one.found);
    --one.all->open_;
    return 0;
  }

  void add(sd_bus_message* signal) {
    int interface = 0;
    int protocol = 0;
    const char* name = nullptr;
    if (sd_bus_message_read(signal, "iis", &interface, &protocol, &name) < 0 || !is_instance_name(name)) return;
    if (found_.size() == kMaxFound) return;
    const auto [place, is_new] = found_.try_emplace(name, One{this, {.instance = {name}}});
    if (!is_new || found_.size() > kDescribed) return;
    ++open_;
    avahi_.call(described, &place->second, "ResolveService", "iisssiu", interface, protocol, name, kService, kLocal,
                kAny, kNoAddress);
  }

  Conversation avahi_;
  std::map<std::string, One> found_;
  std::size_t open_ = 0;     ///< pending queries
  std::size_t watched_ = 0;  ///< size of found_ when watch() was called
};

}  // namespace

std::vector<Found> resolve_by_avahi(const Instance& instance) { return {Resolution(instance).run()}; }

std::vector<Found> browse_by_avahi() { return Browsing().run(); }

}  // namespace tendon::dns_sd
