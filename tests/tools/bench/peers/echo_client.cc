// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/peers/echo_client.h"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>

#include "server/machine/clock.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {
namespace {

constexpr Duration kLongestStart = std::chrono::seconds(10);

}  // namespace

void EchoSetup::announce(const std::string& address) {
  if (address.size() >= address_.size()) throw std::runtime_error(address + ": expected a shorter address");
  std::ranges::copy(address, address_.begin());
  announced_.store(true, std::memory_order_release);
}

std::string EchoSetup::address() const {
  const LocalTime end = clock::now() + kLongestStart;
  while (!announced_.load(std::memory_order_acquire)) {
    if (clock::now() > end) throw std::runtime_error("the server does not start");
    clock::sleep_until(clock::now() + std::chrono::milliseconds(1));
  }
  return address_.data();
}

void EchoSetup::delay_reply() const {
  if (reply_delay <= Duration::zero()) return;
  for (const LocalTime end = clock::now() + reply_delay; clock::now() < end;) {
  }
}

EchoTimes measure_echo(const Load& load, EchoClient& client) {
  const LocalTime end = clock::now() + kLongestStart;
  while (!client.request_reply()) {
    if (clock::now() > end) throw std::runtime_error("the server does not reply");
  }
  for (std::size_t i = 0; i < load.warm_up; ++i) client.request_reply();
  EchoTimes times;
  times.us.reserve(load.requests);
  LocalTime due = clock::now();
  for (std::size_t i = 0; i < load.requests; ++i) {
    if (load.period > Duration::zero()) {
      due = std::max(due + load.period, clock::now());
      clock::sleep_until(due);
    }
    const LocalTime began = clock::now();
    if (client.request_reply()) {
      times.us.push_back(1e6 * seconds(clock::now() - began));
    } else {
      ++times.lost;
    }
  }
  return times;
}

EchoTimes measure_echo(const Load& load, const std::function<void(EchoSetup&)>& serve, const MakeClient& make) {
  const SharedMemory<EchoSetup> setup;
  setup->number = ::getpid();
  setup->reply_delay = load.reply_delay;
  const AtPriority high(load.priority);  // the server and all later threads inherit it
  const OtherProcess other([&] { serve(*setup); });
  struct Killer {
    const OtherProcess& process;
    ~Killer() { process.signal(SIGKILL); }
  } const killer{other};
  const std::unique_ptr<EchoClient> client = make(*setup);
  return measure_echo(load, *client);
}

int peer_main(int argc, char** argv, const std::string& name, const std::function<void(EchoSetup&)>& serve,
              const MakeClient& make) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: %s REQUESTS WARM_UP PERIOD_US REPLY_DELAY_US PRIORITY, as tendon-lab bench calls it\n",
                 argv[0]);
    return 2;
  }
  const auto number = [argv](int i) { return static_cast<std::size_t>(std::strtoull(argv[i], nullptr, 10)); };
  const auto us = [&number](int i) { return std::chrono::microseconds(number(i)); };
  try {
    const EchoTimes times = measure_echo({.requests = number(1),
                                          .warm_up = number(2),
                                          .period = us(3),
                                          .reply_delay = us(4),
                                          .priority = static_cast<int>(number(5))},
                                         serve, make);
    std::printf("%s\n%llu\n", name.c_str(), static_cast<unsigned long long>(times.lost));
    for (const double time : times.us) std::printf("%.3f\n", time);
    std::fflush(stdout);
    ::_exit(0);  // does not wait for the threads of the library
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    std::fflush(stderr);
    ::_exit(1);
  }
}

}  // namespace tendon::bench
