// SPDX-License-Identifier: Apache-2.0
#include "tests/support/fake_avahi.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-bus.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace tendon::testing {
namespace {

constexpr const char* kEntryGroup = "org.freedesktop.Avahi.EntryGroup";
constexpr const char* kBrowser = "org.freedesktop.Avahi.ServiceBrowser";

std::vector<std::string> read_strings(sd_bus_message* message) {
  std::vector<std::string> strings;
  sd_bus_message_enter_container(message, 'a', "ay");
  const void* bytes = nullptr;
  std::size_t size = 0;
  while (sd_bus_message_read_array(message, 'y', &bytes, &size) > 0) {
    strings.emplace_back(static_cast<const char*>(bytes), size);
  }
  return strings;
}

/// Sends a signal as avahi-daemon does. A real bus adds the sender.
template <class... Values>
void emit(sd_bus* bus, const char* path, const char* interface, const char* member, const char* types,
          Values... values) {
  sd_bus_message* signal = nullptr;
  sd_bus_message_new_signal(bus, &signal, path, interface, member);
  sd_bus_message_set_sender(signal, ":1.7");
  sd_bus_message_append(signal, types, values...);
  sd_bus_send(bus, signal, nullptr);
  sd_bus_message_unref(signal);
}

}  // namespace

struct FakeAvahi::Peer {
  struct Group {
    Announced service;
    bool established = false;
  };

  FakeAvahi* avahi = nullptr;
  sd_bus* bus = nullptr;
  bool gone = false;
  std::map<std::string, Group> groups;

  ~Peer() { sd_bus_close_unref(bus); }

  static int on_message(sd_bus_message* message, void* self, sd_bus_error* /*unused*/) {
    auto& peer = *static_cast<Peer*>(self);
    if (sd_bus_message_is_method_call(message, nullptr, nullptr) <= 0) return 0;
    const bool of_the_bus = std::string_view(sd_bus_message_get_interface(message)) == "org.freedesktop.DBus";
    if (of_the_bus) return peer.serve_bus(message);
    if (peer.avahi->silent_) return 1;
    if (peer.avahi->absent_) {
      return sd_bus_reply_method_errorf(message, SD_BUS_ERROR_SERVICE_UNKNOWN, "org.freedesktop.Avahi is not there");
    }
    return peer.serve(message);
  }

  static int serve_bus(sd_bus_message* call) {
    const bool hello = std::string_view(sd_bus_message_get_member(call)) == "Hello";
    return hello ? sd_bus_reply_method_return(call, "s", ":1.1") : sd_bus_reply_method_return(call, nullptr);
  }

  int serve(sd_bus_message* call) {
    const std::string_view what = sd_bus_message_get_member(call);
    if (what == "ResolveService") return resolve(call);
    if (what == "ServiceBrowserNew") return browse(call);
    if (what == "EntryGroupNew") {
      const std::string path = "/Client0/EntryGroup" + std::to_string(groups.size());
      groups[path] = {};
      return sd_bus_reply_method_return(call, "o", path.c_str());
    }
    const std::string path = sd_bus_message_get_path(call);
    Group& group = groups.at(path);
    if (what == "AddService") add(call, group.service);
    if (what == "Reset" || what == "Free") group = {};
    sd_bus_reply_method_return(call, nullptr);
    if (what == "Commit") {
      group.established = !avahi->occupied_.contains(group.service.name);
      emit(bus, path.c_str(), kEntryGroup, "StateChanged", "is", group.established ? 2 : 3, "");
    }
    return 1;
  }

  static void add(sd_bus_message* call, Announced& service) {
    const char* name = nullptr;
    const char* type = nullptr;
    sd_bus_message_read(call, "iiussssq", &service.interface, &service.protocol, nullptr, &name, &type, nullptr,
                        nullptr, &service.port);
    service.name = name;
    service.type = type;
    service.txt = read_strings(call);
  }

  int resolve(sd_bus_message* call) const {
    const char* name = nullptr;
    int family = 0;
    unsigned flags = 0;
    sd_bus_message_read(call, "iisssiu", nullptr, nullptr, &name, nullptr, nullptr, &family, &flags);
    const auto found = avahi->services_.find(name);
    const bool other = found != avahi->services_.end() && family >= 0 &&
                       (found->second.ip.find(':') != std::string::npos) != (family == 1);
    if (found == avahi->services_.end() || other) {
      return sd_bus_reply_method_errorf(call, "org.freedesktop.Avahi.TimeoutError", "Timeout reached");
    }
    const Service& service = found->second;
    sd_bus_message* reply = nullptr;
    sd_bus_message_new_method_return(call, &reply);
    sd_bus_message_append(reply, "iissssisq", 2, 0, name, "_tendon._udp", "local", service.host.c_str(), 0,
                          flags != 0 ? "" : service.ip.c_str(), service.port);
    sd_bus_message_open_container(reply, 'a', "ay");
    for (const std::string& text : service.txt) sd_bus_message_append_array(reply, 'y', text.data(), text.size());
    sd_bus_message_close_container(reply);
    sd_bus_message_append(reply, "u", 0U);
    sd_bus_send(bus, reply, nullptr);
    sd_bus_message_unref(reply);
    return 1;
  }

  int browse(sd_bus_message* call) const {
    constexpr const char* kPath = "/Client0/ServiceBrowser1";
    // The first signals are sent before the reply that contains the path, because Avahi is allowed to do this.
    for (const auto& [name, service] : avahi->services_) {
      for (const int protocol : {0, 1}) {
        emit(bus, kPath, kBrowser, "ItemNew", "iisssu", 2, protocol, name.c_str(), "_tendon._udp", "local", 0U);
      }
    }
    sd_bus_reply_method_return(call, "o", kPath);
    emit(bus, kPath, kBrowser, "AllForNow", "");
    return 1;
  }
};

FakeAvahi::FakeAvahi(const std::filesystem::path& socket)
    : address_("unix:path=" + socket.string()), listening_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  if (socket.string().size() >= sizeof at.sun_path) throw std::runtime_error(socket.string() + " is too long");
  std::memcpy(at.sun_path, socket.c_str(), socket.string().size());
  if (::bind(listening_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 || ::listen(listening_, 8) != 0) {
    throw std::runtime_error("no socket at " + socket.string());
  }
  thread_ = std::thread([this] { run(); });
}

FakeAvahi::~FakeAvahi() {
  stop_ = true;
  thread_.join();
  ::close(listening_);
}

void FakeAvahi::put(const std::string& name, const Service& service) {
  const std::lock_guard lock(mutex_);
  services_[name] = service;
}

void FakeAvahi::take(const std::string& name) {
  const std::lock_guard lock(mutex_);
  services_.erase(name);
}

void FakeAvahi::occupy(const std::string& name) {
  const std::lock_guard lock(mutex_);
  occupied_.insert(name);
}

void FakeAvahi::set_absent(bool absent) {
  const std::lock_guard lock(mutex_);
  absent_ = absent;
}

void FakeAvahi::come_back() {
  const std::lock_guard lock(mutex_);
  absent_ = false;
  came_back_ = true;
}

std::vector<FakeAvahi::Announced> FakeAvahi::announced() {
  const std::lock_guard lock(mutex_);
  std::vector<Announced> all;
  for (const auto& peer : peers_) {
    for (const auto& [path, group] : peer->groups) {
      if (group.established) all.push_back(group.service);
    }
  }
  return all;
}

void FakeAvahi::run() {
  while (!stop_) {
    std::vector<pollfd> ready{{listening_, POLLIN, 0}};
    for (const auto& peer : peers_) ready.push_back({sd_bus_get_fd(peer->bus), POLLIN, 0});
    ::poll(ready.data(), ready.size(), 5);
    const std::lock_guard lock(mutex_);
    if (ready[0].revents != 0) {
      const int fd = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      Peer& peer = *peers_.emplace_back(std::make_unique<Peer>());
      peer.avahi = this;
      sd_bus_new(&peer.bus);
      sd_bus_set_fd(peer.bus, fd, fd);
      sd_bus_set_server(peer.bus, 1, {});
      sd_bus_add_filter(peer.bus, nullptr, Peer::on_message, &peer);
      sd_bus_start(peer.bus);
    }
    for (const auto& peer : peers_) {
      if (came_back_) {
        emit(peer->bus, "/org/freedesktop/DBus", "org.freedesktop.DBus", "NameOwnerChanged", "sss",
             "org.freedesktop.Avahi", "", ":1.7");
      }
      int more = 1;
      while (more > 0) more = sd_bus_process(peer->bus, nullptr);
      peer->gone = more < 0;
    }
    came_back_ = false;
    std::erase_if(peers_, [](const auto& peer) { return peer->gone; });
  }
}

}  // namespace tendon::testing
