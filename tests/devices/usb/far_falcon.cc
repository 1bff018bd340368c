// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/far_falcon.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "server/machine/realtime.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;

/// The priority must be higher than that of the server, because this thread simulates hardware.
constexpr int kPriority = kHapticPriority + 15;
constexpr Duration kRound = 1ms;

int checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

void close_if_open(int& file) {
  if (file >= 0) ::close(file);
  file = -1;
}

bool send_node(int to, std::span<const std::uint8_t> descriptors, int file) {
  std::vector<std::uint8_t> bytes(descriptors.begin(), descriptors.end());
  iovec part{.iov_base = bytes.data(), .iov_len = bytes.size()};
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* const header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof file);
  std::memcpy(CMSG_DATA(header), &file, sizeof file);
  return sendmsg(to, &message, MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

}  // namespace

FarFalcon::FarFalcon(const FakeFalcon::Options& options, const std::filesystem::path& folder)
    : falcon_(options), socket_(folder / "falcon") {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  if (socket_.native().size() >= sizeof address.sun_path) {
    throw std::system_error(ENAMETOOLONG, std::generic_category(), socket_);
  }
  socket_.native().copy(address.sun_path, sizeof address.sun_path - 1);
  listener_ = checked(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), "socket");
  checked(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "bind");
  checked(listen(listener_, 4), "listen");
  thread_ = std::thread([this] { run(); });
}

FarFalcon::~FarFalcon() {
  stop_ = true;
  thread_.join();
  for (Session& session : sessions_) hang_up(session);
  ::close(listener_);
}

std::vector<std::string> FarFalcon::environment() const {
  return {std::string("LD_PRELOAD=") + TENDON_FAR_USBFS, "TENDON_FAR_FALCON=" + socket_.string()};
}

void FarFalcon::set_user(std::function<void(FakeFalcon&, LocalTime)> user) {
  const std::lock_guard lock(mutex_);
  user_ = std::move(user);
}

void FarFalcon::plug() {
  const std::lock_guard lock(mutex_);
  falcon_.plug();
}

void FarFalcon::unplug() {
  const std::lock_guard lock(mutex_);
  falcon_.unplug();
  for (Session& session : sessions_) hang_up(session);
  sessions_.clear();
}

FarFalcon::Seen FarFalcon::seen() const {
  const std::lock_guard lock(mutex_);
  Seen seen = seen_;
  seen.open = !sessions_.empty();
  return seen;
}

void FarFalcon::run() {
  enter_realtime(kPriority);
  while (!stop_) {
    const LocalTime at = real_now();
    {
      const std::lock_guard lock(mutex_);
      turn(at);
    }
    wait(at);
  }
}

void FarFalcon::wait(LocalTime at) {
  std::vector<pollfd> files = {{listener_, POLLIN, 0}};
  Duration most = kRound;
  {
    const std::lock_guard lock(mutex_);
    for (const Session& session : sessions_) {
      files.push_back({session.cable, POLLIN, 0});
      files.push_back({session.master, POLLIN, 0});
      most = std::clamp<Duration>(falcon_.next_in() - at, 10us, most);
    }
  }
  const timespec timeout{.tv_sec = 0, .tv_nsec = most.count()};
  ppoll(files.data(), files.size(), &timeout, nullptr);
}

void FarFalcon::turn(LocalTime at) {
  if (turned_) seen_.longest_gap = std::max(seen_.longest_gap, at - *turned_);
  turned_ = at;
  if (user_) user_(falcon_, at);
  const bool pushed = falcon_.pushes();
  for (Session& session : sessions_) serve(session, at);
  std::erase_if(sessions_, [](const Session& session) { return session.master < 0; });
  take_in_new();
  if (pushed && !falcon_.pushes()) seen_.let_go = at;
  if (!pushed && falcon_.pushes()) ++seen_.pushes_begun;
}

void FarFalcon::serve(Session& session, LocalTime at) {
  if (session.cable >= 0) {
    const bool heard = session.plug->turn(at);
    if (!session.plug->last().empty()) seen_.last = session.plug->last();
    if (std::exchange(session.said, session.plug->said()) != session.plug->said()) {
      tcflow(session.slave, TCOON);  // NOLINT(concurrency-mt-unsafe): nobody else writes to it
    }
    if (!heard) {
      close_if_open(session.cable);
      close_if_open(session.slave);
    }
  }
  hear_node(session, at);
}

void FarFalcon::hear_node(Session& session, LocalTime at) {
  std::array<std::uint8_t, 256> bytes;
  const ssize_t size = ::read(session.master, bytes.data(), bytes.size());
  if (size > 0) {
    session.frames.insert(session.frames.end(), bytes.begin(), bytes.begin() + size);
    auto& frames = session.frames;
    while (frames.size() >= 2 && frames.size() >= 2U + frames[1]) {
      seen_.last.assign(1, frames[0]);
      seen_.last.insert(seen_.last.end(), frames.begin() + 2, frames.begin() + 2 + frames[1]);
      falcon_.write(at, std::span(seen_.last).subspan(1));
      ++seen_.by_node;
      frames.erase(frames.begin(), frames.begin() + 2 + frames[1]);
    }
  } else if (size < 0 && errno == EIO) {
    hang_up(session);
  }
}

void FarFalcon::hang_up(Session& session) {
  close_if_open(session.cable);
  close_if_open(session.slave);
  close_if_open(session.master);
}

void FarFalcon::take_in_new() {
  for (int cable = -1; (cable = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC)) >= 0;) {
    Session session;
    session.cable = cable;
    if (falcon_.plugged()) {
      session.master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
      std::array<char, 64> name{};
      if (session.master < 0 || grantpt(session.master) != 0 || unlockpt(session.master) != 0 ||
          ptsname_r(session.master, name.data(), name.size()) != 0) {
        std::abort();
      }
      session.slave = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
      termios raw{};
      tcgetattr(session.slave, &raw);
      cfmakeraw(&raw);
      tcsetattr(session.slave, TCSANOW, &raw);
    }
    if (session.slave < 0 || !send_node(cable, falcon_.descriptors(), session.slave)) {
      hang_up(session);
      continue;
    }
    session.plug = std::make_unique<socket_cable::Plug>(falcon_, cable);
    sessions_.push_back(std::move(session));
  }
}

}  // namespace tendon
