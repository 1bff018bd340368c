// SPDX-License-Identifier: Apache-2.0
//
// Avahi over D-Bus (org.freedesktop.Avahi.Server.xml and EntryGroup.xml of Avahi 0.8).
#include "server/machine/announcer.h"

#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <systemd/sd-bus.h>
#include <systemd/sd-event.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <deque>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "devices/late_library.h"
#include "server/machine/doorbell.h"

namespace tendon {
namespace {

constexpr const char* kAvahi = "org.freedesktop.Avahi";
constexpr const char* kServer = "org.freedesktop.Avahi.Server";
constexpr const char* kEntryGroup = "org.freedesktop.Avahi.EntryGroup";
constexpr int kAnyInterface = -1;
constexpr int kAnyProtocol = -1;
constexpr int kIpv4 = 0;
constexpr int kIpv6 = 1;

// The states in EntryGroup.StateChanged.
constexpr int kEstablished = 2;
constexpr int kCollision = 3;
constexpr int kFailure = 4;
// The states in Server.StateChanged.
constexpr int kRunning = 2;

/// µs. The delay before connecting to the D-Bus system bus again. No polling is required for avahi-daemon.
constexpr std::uint64_t kTryAgain = 5'000'000;
constexpr int kMostNames = 100;  ///< more collisions are probably an attack

/// The functions of libsystemd, which is loaded when the first announcer is created.
struct Systemd {
  LateLibrary file{"libsystemd.so.0"};
  decltype(&::sd_bus_attach_event) bus_attach_event = file["sd_bus_attach_event"];
  decltype(&::sd_bus_call_async) bus_call_async = file["sd_bus_call_async"];
  decltype(&::sd_bus_call_method_async) bus_call_method_async = file["sd_bus_call_method_async"];
  decltype(&::sd_bus_close_unref) bus_close_unref = file["sd_bus_close_unref"];
  decltype(&::sd_bus_match_signal) bus_match_signal = file["sd_bus_match_signal"];
  decltype(&::sd_bus_match_signal_async) bus_match_signal_async = file["sd_bus_match_signal_async"];
  decltype(&::sd_bus_message_append) bus_message_append = file["sd_bus_message_append"];
  decltype(&::sd_bus_message_append_array) bus_message_append_array = file["sd_bus_message_append_array"];
  decltype(&::sd_bus_message_close_container) bus_message_close_container = file["sd_bus_message_close_container"];
  decltype(&::sd_bus_message_get_error) bus_message_get_error = file["sd_bus_message_get_error"];
  decltype(&::sd_bus_message_get_path) bus_message_get_path = file["sd_bus_message_get_path"];
  decltype(&::sd_bus_message_is_method_error) bus_message_is_method_error = file["sd_bus_message_is_method_error"];
  decltype(&::sd_bus_message_new_method_call) bus_message_new_method_call = file["sd_bus_message_new_method_call"];
  decltype(&::sd_bus_message_open_container) bus_message_open_container = file["sd_bus_message_open_container"];
  decltype(&::sd_bus_message_read) bus_message_read = file["sd_bus_message_read"];
  decltype(&::sd_bus_message_unref) bus_message_unref = file["sd_bus_message_unref"];
  decltype(&::sd_bus_open_system) bus_open_system = file["sd_bus_open_system"];
  decltype(&::sd_bus_slot_unref) bus_slot_unref = file["sd_bus_slot_unref"];
  decltype(&::sd_event_add_io) event_add_io = file["sd_event_add_io"];
  decltype(&::sd_event_add_time_relative) event_add_time_relative = file["sd_event_add_time_relative"];
  decltype(&::sd_event_exit) event_exit = file["sd_event_exit"];
  decltype(&::sd_event_loop) event_loop = file["sd_event_loop"];
  decltype(&::sd_event_new) event_new = file["sd_event_new"];
  decltype(&::sd_event_source_get_event) event_source_get_event = file["sd_event_source_get_event"];
  decltype(&::sd_event_unref) event_unref = file["sd_event_unref"];
};

const Systemd& sd() {
  static const Systemd kLoaded;
  return kLoaded;
}

struct Release {
  void operator()(sd_event* loop) const { sd().event_unref(loop); }
  void operator()(sd_bus* bus) const { sd().bus_close_unref(bus); }
  void operator()(sd_bus_message* message) const { sd().bus_message_unref(message); }
  void operator()(sd_bus_slot* question) const { sd().bus_slot_unref(question); }
};

bool same_ip(const sockaddr* address, const Address& ours) {
  if (address == nullptr) return false;
  if (address->sa_family == AF_INET && is_ipv4(ours)) {
    sockaddr_in v4{};
    std::memcpy(&v4, address, sizeof v4);
    return std::memcmp(&v4.sin_addr, &ours.ip[12], 4) == 0;
  }
  if (address->sa_family != AF_INET6) return false;
  sockaddr_in6 v6{};
  std::memcpy(&v6, address, sizeof v6);
  return std::memcmp(&v6.sin6_addr, ours.ip.data(), ours.ip.size()) == 0;
}

int interface_of(const Address& address) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return kAnyInterface;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(all, &::freeifaddrs);
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (same_ip(one->ifa_addr, address)) return static_cast<int>(::if_nametoindex(one->ifa_name));
  }
  return kAnyInterface;
}

/// Note that [::] also accepts IPv4 (server/machine/udp_link.h).
int protocol_of(const Address& address) {
  if (is_ipv4(address)) return kIpv4;
  return address.ip == decltype(address.ip){} ? kAnyProtocol : kIpv6;
}

}  // namespace

class Announcer::Avahi {
 public:
  Avahi(std::vector<Device> devices, const Address& listen, Say say)
      : port_(listen.port), interface_(interface_of(listen)), protocol_(protocol_of(listen)), say_(std::move(say)) {
    for (Device& device : devices) entries_.push_back({.avahi = this, .device = std::move(device)});
    sd_event* loop = nullptr;
    if (sd().event_new(&loop) < 0) throw std::runtime_error("[discovery] announce: cannot create an event loop");
    loop_.reset(loop);
    if (sd().event_add_io(loop, nullptr, end_.fd(), EPOLLIN, on_end, nullptr) < 0) {
      throw std::runtime_error("[discovery] announce: cannot create an event loop");
    }
  }

  void run() {
    open();
    sd().event_loop(loop_.get());
    close();
  }
  void stop() noexcept { end_.ring(); }

 private:
  struct Entry {
    Avahi* avahi;
    Device device;
    std::string name{};
    std::string group{};
    int attempt = 1;
    std::unique_ptr<sd_bus_slot, Release> question{};
  };

  static int on_end(sd_event_source* source, int, std::uint32_t, void*) noexcept {
    return sd().event_exit(sd().event_source_get_event(source), 0);
  }
  static int on_time(sd_event_source*, std::uint64_t, void* self) noexcept {
    static_cast<Avahi*>(self)->open();
    return 0;
  }
  static int on_bus_lost(sd_bus_message*, void* self, sd_bus_error*) noexcept {
    static_cast<Avahi*>(self)->no_bus("the connection was closed");
    return 0;
  }
  static int on_owner(sd_bus_message* signal, void* self, sd_bus_error*) noexcept {
    static_cast<Avahi*>(self)->owner_changed(signal);
    return 0;
  }
  static int on_server(sd_bus_message* signal, void* self, sd_bus_error*) noexcept {
    std::int32_t state = 0;
    // The host name may have changed.
    if (sd().bus_message_read(signal, "i", &state) > 0 && state == kRunning) static_cast<Avahi*>(self)->announce();
    return 0;
  }
  static int on_group(sd_bus_message* signal, void* self, sd_bus_error*) noexcept {
    static_cast<Avahi*>(self)->group_changed(signal);
    return 0;
  }
  static int on_new_group(sd_bus_message* answer, void* entry, sd_bus_error*) noexcept {
    Entry& one = *static_cast<Entry*>(entry);
    one.avahi->group_made(one, answer);
    return 0;
  }
  static int on_added(sd_bus_message* answer, void* entry, sd_bus_error*) noexcept {
    Entry& one = *static_cast<Entry*>(entry);
    one.avahi->added(one, answer);
    return 0;
  }

  void say(bool warning, const std::string& sentence) {
    if (warning && sentence == said_) return;
    said_ = warning ? sentence : std::string();
    say_(warning, sentence);
  }

  void lost(const std::string& why) {
    say(true, "not announced ([discovery]): " + why +
                  ". Expected a running avahi-daemon; clients can still use the address of this server");
  }

  /// Schedules another attempt because this may be called from a callback of the bus.
  void no_bus(const std::string& why) {
    lost("there is no D-Bus system bus (" + why + ")");
    if (waits_) return;
    waits_ = sd().event_add_time_relative(loop_.get(), nullptr, CLOCK_MONOTONIC, kTryAgain, 0, on_time, this) >= 0;
  }

  /// Avahi removes the announcements when the connection is closed.
  void close() {
    for (Entry& entry : entries_) {
      entry.group.clear();
      entry.question.reset();
    }
    bus_.reset();
  }

  void open() {
    waits_ = false;
    close();
    sd_bus* bus = nullptr;
    if (const int error = sd().bus_open_system(&bus); error < 0) return no_bus(std::generic_category().message(-error));
    bus_.reset(bus);
    sd().bus_match_signal(bus, nullptr, "org.freedesktop.DBus.Local", "/org/freedesktop/DBus/Local",
                          "org.freedesktop.DBus.Local", "Disconnected", on_bus_lost, this);
    sd().bus_match_signal_async(bus, nullptr, "org.freedesktop.DBus", "/org/freedesktop/DBus", "org.freedesktop.DBus",
                                "NameOwnerChanged", on_owner, nullptr, this);
    sd().bus_match_signal_async(bus, nullptr, kAvahi, "/", kServer, "StateChanged", on_server, nullptr, this);
    sd().bus_match_signal_async(bus, nullptr, kAvahi, nullptr, kEntryGroup, "StateChanged", on_group, nullptr, this);
    if (sd().bus_attach_event(bus, loop_.get(), 0) < 0) return no_bus("the connection was lost");
    announce();
  }

  void announce() {
    for (Entry& entry : entries_) {
      if (!entry.group.empty()) tell(entry, "Free");
      entry.group.clear();
      entry.attempt = 1;
      entry.name = entry.device.name;
      sd_bus_slot* question = nullptr;
      sd().bus_call_method_async(bus_.get(), &question, kAvahi, "/", kServer, "EntryGroupNew", on_new_group, &entry,
                                 nullptr);
      entry.question.reset(question);
    }
  }

  void tell(const Entry& entry, const char* what) {
    sd().bus_call_method_async(bus_.get(), nullptr, kAvahi, entry.group.c_str(), kEntryGroup, what, nullptr, nullptr,
                               nullptr);
  }

  void group_made(Entry& entry, sd_bus_message* answer) {
    const char* path = nullptr;
    if (sd().bus_message_is_method_error(answer, nullptr) > 0 || sd().bus_message_read(answer, "o", &path) < 0) {
      return refused(answer);
    }
    entry.group = path;
    add(entry);
  }

  void add(Entry& entry) {
    sd_bus_message* made = nullptr;
    if (sd().bus_message_new_method_call(bus_.get(), &made, kAvahi, entry.group.c_str(), kEntryGroup, "AddService") <
        0) {
      return no_bus("the connection was lost");
    }
    const std::unique_ptr<sd_bus_message, Release> message(made);
    // If the domain and host are empty, Avahi uses its defaults.
    sd().bus_message_append(made, "iiussssq", interface_, protocol_, 0U, entry.name.c_str(), dns_sd::kService, "", "",
                            port_);
    sd().bus_message_open_container(made, 'a', "ay");
    for (const std::string& text : dns_sd::to_txt(entry.device.about)) {
      sd().bus_message_append_array(made, 'y', text.data(), text.size());
    }
    sd().bus_message_close_container(made);
    sd_bus_slot* question = nullptr;
    sd().bus_call_async(bus_.get(), &question, made, on_added, &entry, 0);
    entry.question.reset(question);
  }

  void added(Entry& entry, sd_bus_message* answer) {
    if (sd().bus_message_is_method_error(answer, "org.freedesktop.Avahi.CollisionError") > 0) return rename(entry);
    if (sd().bus_message_is_method_error(answer, nullptr) > 0) return refused(answer);
    tell(entry, "Commit");
  }

  void rename(Entry& entry) {
    if (++entry.attempt > kMostNames)
      return lost(std::to_string(kMostNames) + " names are already used on this network");
    entry.name = dns_sd::another_name(entry.device.name, entry.attempt);
    add(entry);
  }

  void refused(sd_bus_message* answer) {
    const sd_bus_error* error = sd().bus_message_get_error(answer);
    const char* why = error == nullptr ? "no answer" : error->message != nullptr ? error->message : error->name;
    lost(std::string("avahi-daemon refused the announcement (") + why + ")");
  }

  void owner_changed(sd_bus_message* signal) {
    std::array<const char*, 3> names{};
    if (sd().bus_message_read(signal, "sss", &names[0], &names[1], &names[2]) <= 0) return;
    if (std::string_view(names[0]) != kAvahi) return;
    if (*names[2] == '\0') {
      for (Entry& entry : entries_) entry.group.clear();
      return lost("avahi-daemon has stopped");
    }
    announce();
  }

  void group_changed(sd_bus_message* signal) {
    const char* const path = sd().bus_message_get_path(signal);
    const auto entry = std::find_if(entries_.begin(), entries_.end(),
                                    [path](const Entry& one) { return path != nullptr && one.group == path; });
    std::int32_t state = 0;
    const char* error = nullptr;
    if (entry == entries_.end() || sd().bus_message_read(signal, "is", &state, &error) <= 0) return;
    if (state == kEstablished) {
      say(false, "announced as \"" + entry->name + "\" (" + dns_sd::kService + ", port " + std::to_string(port_) + ")" +
                     (entry->attempt > 1 ? ", because \"" + entry->device.name + "\" is taken" : ""));
    } else if (state == kCollision) {
      tell(*entry, "Reset");
      rename(*entry);
    } else if (state == kFailure) {
      lost(std::string("avahi-daemon failed (") + error + ")");
    }
  }

  std::uint16_t port_;
  int interface_;
  int protocol_;
  Say say_;
  std::string said_;
  bool waits_ = false;
  Doorbell end_;
  std::unique_ptr<sd_event, Release> loop_;
  std::unique_ptr<sd_bus, Release> bus_;
  std::deque<Entry> entries_;  // must have stable addresses for the callbacks
};

Announcer::Announcer(std::vector<Device> devices, const Address& listen, Say say) {
  if (is_loopback(listen)) {
    throw std::runtime_error("[discovery] announce: the server listens on " + to_string(listen) +
                             ", which other machines cannot reach; expected [network] listen = \"0.0.0.0:47100\" or "
                             "another address of this machine, and keys");
  }
  avahi_ = std::make_unique<Avahi>(std::move(devices), listen, std::move(say));
}

Announcer::~Announcer() = default;

void Announcer::run() { avahi_->run(); }

void Announcer::stop() noexcept { avahi_->stop(); }

}  // namespace tendon
