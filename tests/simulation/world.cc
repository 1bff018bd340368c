// SPDX-License-Identifier: Apache-2.0
#include "tests/simulation/world.h"

#include <algorithm>
#include <cstring>

#include "core/time.h"

namespace tendon::simulation {

namespace {

/// The log thread's period.
constexpr Duration kRecordPeriod = std::chrono::milliseconds(20);

Mailboxes::Capacities capacities(const World::Config& config) {
  Mailboxes::Capacities mail = config.mail;
  if (config.record) mail.datagrams = Mailboxes::Capacities{}.datagrams;
  return mail;
}

Address address_of(std::uint16_t port) {
  Address address;
  address.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 127, 0, 0, 1};
  address.port = port;
  return address;
}

}  // namespace

class Network::End final : public Link {
 public:
  End(Network& network, const Address& address) : network_(network), address_(address) {}

  void send(const Address& to, std::span<const std::byte> datagram) override {
    network_.launch(address_, to, datagram);
  }

  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    if (inbox_.empty()) return 0;
    const auto [sender, datagram] = std::move(inbox_.front());
    inbox_.pop_front();
    from = sender;
    std::memcpy(buffer.data(), datagram.data(), std::min(buffer.size(), datagram.size()));
    return datagram.size();
  }

  void arrive(const Address& from, std::vector<std::byte> datagram) { inbox_.emplace_back(from, std::move(datagram)); }

 private:
  Network& network_;
  Address address_;
  std::deque<std::pair<Address, std::vector<std::byte>>> inbox_;
};

Network::Network(std::uint64_t seed, const injector::Profile& to_server, const injector::Profile& from_server,
                 const Address& server)
    : seed_(seed), to_server_(to_server), from_server_(from_server), server_(server) {}

Link& Network::open(const Address& address) {
  auto& end = ends_[address];
  end = std::make_unique<End>(*this, address);
  return *end;
}

void Network::launch(const Address& from, const Address& to, std::span<const std::byte> datagram) {
  const auto key = std::pair(from, to);
  auto route = routes_.find(key);
  if (route == routes_.end()) {
    const bool up = to == server_;
    const std::uint32_t link = up ? from.port : to.port;
    const auto direction = up ? injector::Direction::kUp : injector::Direction::kDown;
    route = routes_.emplace(key, injector::Injector(up ? to_server_ : from_server_, seed_, link, direction)).first;
  }
  const injector::Packet packet{
      .arrival = now_, .size = static_cast<std::uint32_t>(datagram.size()), .bytes = datagram};
  const injector::Decision decision = route->second.decide(packet);
  const auto take_off = [&](LocalTime due) {
    flying_.emplace(std::pair(due, launched_++), Flying{from, to, {datagram.begin(), datagram.end()}});
  };
  if (decision.verdict != injector::Verdict::kDrop) take_off(decision.release);
  if (decision.duplicate) take_off(*decision.duplicate);
}

void Network::forge(const Address& from, const Address& to, std::vector<std::byte> datagram) {
  ends_.at(to)->arrive(from, std::move(datagram));
}

std::vector<Address> Network::deliver(LocalTime now) {
  now_ = now;
  std::vector<Address> mail;
  while (!flying_.empty() && flying_.begin()->first.first <= now) {
    Flying flying = std::move(flying_.begin()->second);
    flying_.erase(flying_.begin());
    if (const auto end = ends_.find(flying.to); end != ends_.end()) {
      end->second->arrive(flying.from, std::move(flying.datagram));
      mail.push_back(flying.to);
    }
  }
  return mail;
}

std::optional<LocalTime> Network::next_arrival() const {
  if (flying_.empty()) return std::nullopt;
  return flying_.begin()->first.first;
}

injector::Profile World::Config::bad() { return injector::parse_profile("delay=uniform(15ms,25ms) loss=2%"); }

World::World(const Config& config, Device& device)
    : config_(config),
      now_(std::chrono::seconds(1)),  // no code may take zero for the beginning of time
      random_(config.seed),
      server_address_(address_of(47100)),
      network_(config.seed, config.to_server, config.from_server, server_address_),
      mail_(std::make_unique<Mailboxes>(capacities(config))),
      haptic_(config.loop, device, *mail_),
      network_loop_(
          [&] {
            NetworkLoop::Config network;
            for (std::byte& b : network.secret) b = static_cast<std::byte>(random_());
            network.device_name = device.info().name;
            network.max_force = config.loop.control.max_force;
            network.position_resolution = device.info().position_resolution;
            network.haptic_period = config.loop.period;
            network.max_observers = config.max_observers;
            return network;
          }(),
          network_.open(server_address_), *mail_),
      haptic_due_(now_),
      network_due_(now_),
      record_due_(config.record ? now_ : LocalTime::max()) {
  recorder_config_.scene.text = config.scene_text;
  recorder_config_.scene.seed = config.seed;
  recorder_config_.started = now_;
  if (config.record) recorder_.emplace(recorder_config_, sink_);
}

World::~World() = default;

double World::uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

std::size_t World::add(const std::function<std::unique_ptr<ForceClient>(Link&, LocalTime)>& make) {
  Client client;
  client.address = address_of(static_cast<std::uint16_t>(50000 + clients_.size()));
  client.client = make(network_.open(client.address), now_);
  client.due = now_;
  clients_.push_back(std::move(client));
  return clients_.size() - 1;
}

std::size_t World::add_controller(const ForceClient::Config& config, Physics physics) {
  return add([&](Link& link, LocalTime now) {
    return std::make_unique<ForceClient>(link, server_address_, config, std::move(physics), now);
  });
}

std::size_t World::add_observer(const ForceClient::Config& config, Watch watch) {
  return add([&](Link& link, LocalTime now) {
    return std::make_unique<ForceClient>(link, server_address_, config, std::move(watch), now);
  });
}

void World::kill(std::size_t handle) { clients_[handle].client.reset(); }

void World::step_haptic() {
  haptic_due_ = haptic_.step(now_);
  if (config_.latest_wake > Duration::zero()) {
    haptic_due_ += Duration(static_cast<Duration::rep>(uniform() * static_cast<double>(config_.latest_wake.count())));
  }
  if (config_.pause_probability > 0 && uniform() < config_.pause_probability) haptic_due_ = now_ + config_.pause;
  network_due_ = now_;  // the doorbell
  drain_steps();
}

void World::drain_steps() {
  while (const StepRecord* step = mail_->steps.front()) {
    if (watch_steps_) watch_steps_(*step);
    if (recorder_) recorder_->record(*step);
    mail_->steps.pop();
  }
}

void World::drain_datagrams() {
  while (const DatagramRecord* datagram = mail_->datagrams.front()) {
    recorder_->record(*datagram);
    mail_->datagrams.pop();
  }
}

void World::turn_server() {
  network_due_ = std::max(network_loop_.turn(now_), now_ + Duration(1));
  if (recorder_) drain_datagrams();
}

void World::run_for(Duration duration) {
  const LocalTime end = now_ + duration;
  for (;;) {
    LocalTime next = std::min({haptic_due_, network_due_, record_due_});
    if (const auto arrival = network_.next_arrival()) next = std::min(next, *arrival);
    for (const Client& client : clients_) {
      if (client.client) next = std::min(next, client.due);
    }
    if (next > end) break;
    now_ = std::max(now_, next);

    for (const Address& to : network_.deliver(now_)) {
      if (to == server_address_) network_due_ = now_;
      for (Client& client : clients_) {
        if (client.address == to) client.due = now_;
      }
    }
    if (haptic_due_ <= now_) step_haptic();
    if (network_due_ <= now_) turn_server();
    for (Client& client : clients_) {
      if (client.client && client.due <= now_) client.due = std::max(client.client->turn(now_), now_ + Duration(1));
    }
    if (record_due_ <= now_) {
      recorder_->tick(now_);
      record_due_ = now_ + kRecordPeriod;
    }
  }
  now_ = end;
}

const std::vector<std::byte>& World::finish_recording() {
  recorder_->close();
  return sink_.bytes();
}

}  // namespace tendon::simulation
