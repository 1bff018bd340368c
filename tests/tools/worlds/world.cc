// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/world.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "core/base/time.h"

namespace tendon::simulation {

namespace {

Scene scene_of(const World::Config& config) {
  Scene scene;
  scene.name = "device";
  scene.loop = config.loop;
  scene.network.max_observers = config.max_observers;
  scene.network.adapt_state_rate = config.adapt_state_rate;
  return scene;
}

Assembly::Config assembly_config(const World::Config& config, LocalTime now, std::mt19937_64& random) {
  Assembly::Config assembly{.now = now, .watched = config.mail};
  for (std::byte& b : assembly.network.secret) b = static_cast<std::byte>(random());
  assembly.network.keys = config.keys;
  assembly.network.suites = config.suites;
  assembly.network.rekey = config.rekey;
  assembly.network.session_life = config.session_life;
  if (config.record) assembly.watched->datagrams = Mailboxes::Capacities{}.datagrams;
  return assembly;
}

Address address_of(std::uint16_t port) {
  Address address;
  address.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 127, 0, 0, 1};
  address.port = port;
  return address;
}

/// Wake-ups per kStretch; more than any burst of datagrams causes. An immediate request is served a nanosecond later.
constexpr int kMostWakes = 20'000;
constexpr Duration kStretch = std::chrono::milliseconds(1);

}  // namespace

Network::Weather World::Config::bad() {
  const injector::Profile profile = injector::parse_profile("delay=uniform(15ms,25ms) loss=2%");
  return {profile, profile};
}

World::World(const Config& config, Device& device)
    : config_(config),
      now_(std::chrono::seconds(1)),  // detects code that assumes that the time starts at zero
      random_(config.seed),
      server_address_(address_of(47100)),
      network_(config.seed, config.weather, server_address_, config.players),
      // An empty description preserves datagram sizes, and thereby the digests in README.md.
      assembly_({{.scene = scene_of(config), .device = device, .handle = HandleDescription{}}},
                assembly_config(config, now_, random_), {&network_.server()}),
      haptic_due_(now_),
      network_due_(now_),
      log_due_(now_) {
  recorder_config_.scene.text = config.scene_text;
  recorder_config_.scene.seed = config.seed;
  recorder_config_.started = now_;
  if (config.record) recorder_.emplace(recorder_config_, sink_);
}

World::~World() = default;

double World::uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

World::Client& World::place(const injector::DriftingClock& clock) {
  Client& client = clients_.emplace_back();
  client.address = address_of(static_cast<std::uint16_t>(kFirstClientPort + clients_.size() - 1));
  client.link = &network_.open(client.address);
  client.clock = clock;
  client.due = now_;
  return client;
}

std::size_t World::add_controller(const ForceClient::Config& config, Physics physics,
                                  const injector::DriftingClock& clock) {
  Client& client = place(clock);
  client.client =
      std::make_unique<ForceClient>(*client.link, server_address_, config, std::move(physics), clock.reading(now_));
  return clients_.size() - 1;
}

std::size_t World::add_observer(const ForceClient::Config& config, Watch watch, const injector::DriftingClock& clock) {
  Client& client = place(clock);
  client.client =
      std::make_unique<ForceClient>(*client.link, server_address_, config, std::move(watch), clock.reading(now_));
  return clients_.size() - 1;
}

std::size_t World::add_custom_client(const std::function<std::unique_ptr<CustomClient>(Link&, const Address&)>& make) {
  Client& client = place({});
  client.custom = make(*client.link, server_address_);
  return clients_.size() - 1;
}

template <class Callback>
void World::restart(std::size_t handle, const ForceClient::Config& config, Callback callback) {
  Client& client = clients_[handle];
  network_.open(client.address);
  client.client = std::make_unique<ForceClient>(*client.link, server_address_, config, std::move(callback),
                                                client.clock.reading(now_));
  client.due = now_;
}

void World::restart_controller(std::size_t handle, const ForceClient::Config& config, Physics physics) {
  restart(handle, config, std::move(physics));
}

void World::restart_observer(std::size_t handle, const ForceClient::Config& config, Watch watch) {
  restart(handle, config, std::move(watch));
}

void World::kill(std::size_t handle) {
  clients_[handle].client.reset();
  clients_[handle].custom.reset();
  clients_[handle].due = LocalTime::max();
}

void World::stop(std::size_t handle) {
  clients_[handle].client->stop(clients_[handle].clock.reading(now_));
  kill(handle);
}

void World::step_haptic() {
  haptic_due_ = assembly_.haptic_groups().front().turn(now_);
  if (config_.latest_wake > Duration::zero()) {
    haptic_due_ += Duration(static_cast<Duration::rep>(uniform() * static_cast<double>(config_.latest_wake.count())));
  }
  if (config_.pause_probability > 0 && uniform() < config_.pause_probability) haptic_due_ = now_ + config_.pause;
  network_due_ = now_;
  drain_steps();
}

void World::drain_steps() {
  while (const StepRecord* step = mail().steps.front()) {
    if (watch_steps_) watch_steps_(*step);
    if (recorder_) recorder_->record(*step, 0, mail().ways.name_of(step->force_way));
    mail().steps.pop();
  }
}

void World::drain_datagrams() {
  while (const DatagramRecord* datagram = mail().datagrams.front()) {
    recorder_->record(*datagram);
    mail().datagrams.pop();
  }
}

void World::turn_server() {
  const LocalTime due = assembly_.turn_network(0, now_);
  network_due_ = std::max(due, now_ + Duration(1));
  if (recorder_) drain_datagrams();
  if (watch_turns_) watch_turns_({std::nullopt, due <= now_});
}

void World::turn_log() {
  log_due_ = assembly_.log().turn(now_, 0);
  assembly_.log().take_notices();
  if (recorder_) recorder_->tick(now_);
}

void World::turn_client(std::size_t handle) {
  Client& client = clients_[handle];
  const LocalTime reading = client.clock.reading(now_);
  const LocalTime due = client.client ? client.client->turn(reading) : client.custom->turn(reading);
  // `never` is not a time and must not be converted.
  client.due = due == LocalTime::max() ? due : client.clock.truth(due, now_ + Duration(1));
  if (watch_turns_) watch_turns_({handle, due <= reading});
}

void World::run_for(Duration duration) {
  const LocalTime end = now_ + duration;
  LocalTime since = now_;
  int wakes = 0;
  for (;;) {
    LocalTime next = std::min(haptic_due_, network_due_);
    if (const auto arrival = network_.next_arrival()) next = std::min(next, *arrival);
    for (const Client& client : clients_) next = std::min(next, client.due);
    if (next > end) break;
    now_ = std::max(now_, next);
    if (now_ - since > kStretch) {
      since = now_;
      wakes = 0;
    } else if (++wakes > kMostWakes) {
      throw std::runtime_error("a loop asks to be called again without end");
    }

    network_.deliver(now_);
    if (haptic_due_ <= now_) step_haptic();
    if (network_.take_news_of_server() || network_due_ <= now_) turn_server();
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      const bool news = network_.take_news_of(static_cast<std::uint32_t>(i));
      if ((clients_[i].client || clients_[i].custom) && (news || clients_[i].due <= now_)) turn_client(i);
    }
    // The log loop adds no wake-ups: a wake-up would deliver forged datagrams to the server.
    if (log_due_ <= now_) turn_log();
  }
  now_ = end;
}

const std::vector<std::byte>& World::finish_recording() {
  recorder_->close();
  return sink_.bytes();
}

}  // namespace tendon::simulation
