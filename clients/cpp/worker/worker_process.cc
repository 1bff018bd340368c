// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/worker_process.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "clients/cpp/server_name.h"

namespace tendon::worker {
namespace {

constexpr std::size_t kMostPending = 8;

[[noreturn]] void fail_with(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

class File {
 public:
  File() = default;
  explicit File(int fd) : fd_(fd) {}
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const noexcept { return fd_; }
  bool is_open() const noexcept { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

/// A private directory that is removed in the destructor together with the socket in it.
class PrivateFolder {
 public:
  PrivateFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tendon-proxy-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) fail_with("cannot create the folder " + name);
    path_ = name;
  }
  ~PrivateFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  std::string socket() const { return (path_ / "worker").string(); }

 private:
  std::filesystem::path path_;
};

File listen_at_path(const std::string& path) {
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  if (path.size() >= sizeof to.sun_path)
    throw std::runtime_error(path + " is too long for a socket: set TMPDIR to a shorter path");
  std::ranges::copy(path, std::begin(to.sun_path));
  File file(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!file.is_open() || ::bind(file.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
      ::listen(file.get(), kMostPending) != 0) {
    fail_with("cannot listen at " + path);
  }
  return file;
}

/// If the port of `name` is 0, `port` receives the assigned port.
File listen_at(const ServerName& name, std::uint16_t& port) {
  const Address address = name.look_up().addresses.front();
  if (address.ip == parse_address("0.0.0.0:0").ip || address.ip == Address{}.ip) {
    throw std::runtime_error("listen: expected the address at which workers can reach this machine, got " +
                             name.text());
  }
  sockaddr_in6 to{};
  to.sin6_family = AF_INET6;
  to.sin6_port = htons(address.port);
  std::memcpy(&to.sin6_addr, address.ip.data(), address.ip.size());
  File file(::socket(AF_INET6, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  const int no = 0;
  socklen_t size = sizeof to;
  if (!file.is_open() || ::setsockopt(file.get(), IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof no) != 0 ||
      ::setsockopt(file.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      ::bind(file.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
      ::listen(file.get(), kMostPending) != 0 ||
      ::getsockname(file.get(), reinterpret_cast<sockaddr*>(&to), &size) != 0) {
    fail_with("cannot listen at " + name.text());
  }
  port = ntohs(to.sin6_port);
  return file;
}

std::map<pid_t, pid_t> parents() {
  std::map<pid_t, pid_t> parents;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    const std::string name = entry.path().filename().string();
    pid_t pid = 0;
    if (std::from_chars(name.data(), name.data() + name.size(), pid).ptr != name.data() + name.size()) continue;
    std::ifstream file(entry.path() / "stat");
    std::string text;
    std::getline(file, text);
    const auto name_ends = text.rfind(')');  // format: "12 (a name) S 11 …"
    if (name_ends == std::string::npos || name_ends + 4 > text.size()) continue;
    pid_t parent = 0;
    std::from_chars(text.data() + name_ends + 4, text.data() + text.size(), parent);
    parents[pid] = parent;
  }
  return parents;
}

std::vector<pid_t> descendants(pid_t but) {
  const std::map<pid_t, pid_t> parent_of = parents();
  const pid_t self = ::getpid();
  std::vector<pid_t> found;
  for (const auto& [pid, unused] : parent_of) {
    pid_t up = pid;
    for (int i = 0; i < 64 && up != self && up != but && up > 1; ++i) {
      const auto parent = parent_of.find(up);
      up = parent != parent_of.end() ? parent->second : 0;
    }
    if (up == self && pid != self) found.push_back(pid);
  }
  return found;
}

std::string in_words(int status) {
  if (WIFSIGNALED(status)) return "it was terminated by signal " + std::to_string(WTERMSIG(status));
  return "it exited with status " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

struct WorkerProcess::Files {
  struct Pending {
    File file;
    RecordReader reader{};
  };

  std::optional<PrivateFolder> folder;
  File poll;
  File listener;
  File stream;
  std::vector<Pending> pending;
  pid_t pid = 0;  ///< of the program; 0: not running
  File process;   ///< readable after the program's exit

  void watch(const File& file) const {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = file.get();
    if (::epoll_ctl(poll.get(), EPOLL_CTL_ADD, file.get(), &event) != 0) fail_with("epoll_ctl");
  }
};

WorkerProcess::WorkerProcess(const Config& config) : config_(config), files_(std::make_unique<Files>()) {
  if (::prctl(PR_SET_CHILD_SUBREAPER, 1) != 0) fail_with("cannot become the subreaper of its worker processes");
  files_->poll = File(::epoll_create1(EPOLL_CLOEXEC));
  if (!files_->poll.is_open()) fail_with("epoll_create1");
  if (config.listen.empty()) {
    const std::string path = files_->folder.emplace().socket();
    files_->listener = listen_at_path(path);
    address_ = "unix:" + path;
  } else {
    std::uint16_t port = 0;
    files_->listener = listen_at(ServerName(config.listen), port);
    address_ = "tcp:" + config.listen.substr(0, config.listen.rfind(':') + 1) + std::to_string(port);
  }
  files_->watch(files_->listener);
}

WorkerProcess::~WorkerProcess() {
  kill();
  constexpr int kTurns = 200;
  for (int i = 0; i < kTurns && ending_; ++i) {
    ::usleep(10'000);
    reap();
  }
}

void WorkerProcess::launch(const std::string& secret) {
  if (files_->pid != 0) kill();
  secret_ = secret;
  reader_ = RecordReader();
  ended_ = false;
  const std::string address = std::string(kAddressVariable) + "=" + address_;
  const std::string word = std::string(kSecretVariable) + "=" + secret;
  std::vector<const char*> environment;
  for (char** one = environ; *one != nullptr; ++one) {
    const std::string_view variable = *one;
    const std::string_view name = variable.substr(0, variable.find('='));
    if (name != kAddressVariable && name != kSecretVariable) environment.push_back(*one);
  }
  for (const char* const mine : {address.c_str(), word.c_str()}) environment.push_back(mine);
  environment.push_back(nullptr);
  const std::string command = "exec " + config_.command;
  const std::array<const char*, 4> arguments = {"/bin/sh", "-c", command.c_str(), nullptr};
  const File nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  const pid_t self = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) fail_with("cannot start a process");
  if (pid == 0) {  // only async-signal-safe calls from here
    sigset_t none;
    sigemptyset(&none);
    ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != self) ::_exit(1);
    ::dup2(nothing.get(), STDIN_FILENO);
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    ::execve(arguments[0], const_cast<char* const*>(arguments.data()), const_cast<char* const*>(environment.data()));
    ::_exit(127);
  }
  files_->pid = pid;
  files_->process = File(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  if (!files_->process.is_open()) fail_with("pidfd_open");
  files_->watch(files_->process);
}

void WorkerProcess::kill() {
  files_->stream = File();
  files_->pending.clear();
  files_->process = File();
  files_->pid = 0;
  events_.clear();
  ending_ = true;
  reap();
}

/// Kills the remaining processes of earlier programs and reaps terminated children.
void WorkerProcess::reap() {
  if (ending_) {
    for (const pid_t pid : descendants(files_->pid != 0 ? files_->pid : -1)) ::kill(pid, SIGKILL);
  }
  int status = 0;
  pid_t pid = 0;
  while ((pid = ::waitpid(-1, &status, WNOHANG)) > 0) {
    if (pid != files_->pid) continue;
    files_->pid = 0;
    files_->process = File();
    fail(in_words(status));
  }
  if (ending_) ending_ = !descendants(files_->pid != 0 ? files_->pid : -1).empty();
}

/// Reports that the worker is unusable. Only the first reason is reported.
void WorkerProcess::fail(const std::string& why) {
  files_->stream = File();
  secret_.clear();
  if (!std::exchange(ended_, true)) events_.emplace_back(Ended{why});
}

void WorkerProcess::send(const Record& record) {
  if (!files_->stream.is_open()) return;
  const std::vector<std::byte> bytes = to_bytes(record);
  const ssize_t sent = ::send(files_->stream.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent != static_cast<ssize_t>(bytes.size())) fail("it does not read the data");
}

void WorkerProcess::accept_one() {
  File file(::accept4(files_->listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!file.is_open() || secret_.empty()) return;
  if (files_->pending.size() >= kMostPending) files_->pending.erase(files_->pending.begin());
  if (!config_.listen.empty()) {
    const int yes = 1;
    ::setsockopt(file.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  }
  files_->watch(file);
  files_->pending.push_back({.file = std::move(file)});
}

void WorkerProcess::read_stream() {
  std::array<std::byte, 4096> buffer;
  const auto read = [&](const File& file, RecordReader& to) {
    const ssize_t size = ::recv(file.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (size > 0) to.add({buffer.data(), static_cast<std::size_t>(size)});
    return size > 0 || (size < 0 && (errno == EAGAIN || errno == EINTR));
  };
  for (std::size_t i = 0; i < files_->pending.size() && !files_->stream.is_open();) {
    Files::Pending& connection = files_->pending[i];
    std::optional<Record> first;
    bool keep = read(connection.file, connection.reader);
    try {
      first = connection.reader.next();
    } catch (const std::runtime_error&) {
      keep = false;
    }
    if (first && opens(*first, secret_)) {
      files_->stream = std::move(connection.file);
      reader_ = std::move(connection.reader);
      files_->pending.clear();
      secret_.clear();  // a secret opens the stream only once
      events_.emplace_back(Opened{});
    } else if (first || !keep) {
      files_->pending.erase(files_->pending.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
  if (!files_->stream.is_open()) return;
  const bool more = read(files_->stream, reader_);
  try {
    while (auto record = reader_.next()) events_.emplace_back(*std::move(record));
  } catch (const std::runtime_error& error) {
    return fail(error.what());
  }
  if (!more) {
    reap();  // the exit status explains more than the end of the stream
    fail("it has closed the connection");
  }
}

std::optional<WorkerProcess::Event> WorkerProcess::next() {
  if (events_.empty()) {
    std::array<epoll_event, 16> ready;
    const int count = ::epoll_wait(files_->poll.get(), ready.data(), static_cast<int>(ready.size()), 0);
    bool stream = false;
    bool process = false;
    for (int i = 0; i < count; ++i) {
      const int fd = ready.at(static_cast<std::size_t>(i)).data.fd;
      if (fd == files_->listener.get()) {
        accept_one();
      } else if (fd == files_->process.get()) {
        process = true;
      } else {
        stream = true;
      }
    }
    if (stream) read_stream();
    if (process || ending_) reap();
  }
  if (events_.empty()) return std::nullopt;
  Event event = std::move(events_.front());
  events_.erase(events_.begin());
  return event;
}

int WorkerProcess::descriptor() const noexcept { return files_->poll.get(); }

}  // namespace tendon::worker
