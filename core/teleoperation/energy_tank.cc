// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/energy_tank.h"

#include <cmath>

#include "core/base/expect.h"
#include "core/teleoperation/port_values.h"

namespace tendon {

namespace {

bool possible(const EnergyTankMessage& message) noexcept {
  constexpr double kAccount = EnergyTankMessage::kMostAccount;
  constexpr double kTotal = EnergyTankMessage::kMostTotal;
  return message.epoch > 0 && message.sequence > 0 && within(message.account, -kAccount, kAccount) &&
         within(message.need, 0, kAccount) && within(message.given, 0, kTotal) && within(message.taken, 0, kTotal);
}

}  // namespace

EnergyTank::EnergyTank(const Config& config) : config_(config), allowance_(config.max_account) {
  expect(config.peers >= 1 && config.peers <= kMostPeers, "peers", static_cast<double>(config.peers), "1 to 3");
  for (std::size_t j = 0; j < config.peers; ++j) {
    expect(within(config.joule[j], 1e-6, 1e6), "joule", config.joule[j], "1e-6 to 1e6");
  }
  expect_above_zero(config.start, "start");
  expect_above_zero(config.max_power, "max_power");
  expect(config.max_account > 0 && config.max_account <= EnergyTankMessage::kMostAccount, "max_account",
         config.max_account, "above 0 J, at most 1000 J");
  expect(config.epoch > 0, "epoch", static_cast<double>(config.epoch), "a number above 0");
}

void EnergyTank::receive(std::size_t peer, const EnergyTankMessage& message) noexcept {
  if (peer >= config_.peers) return;
  Peer& from = peers_[peer];
  if (!possible(message)) {
    ++refused_;
    return;
  }
  if (message.epoch < from.epoch || (message.epoch == from.epoch && message.sequence <= from.sequence)) return;
  // The sequence of this port is not reset, because the peer may have messages that answered its previous epoch.
  if (message.epoch > from.epoch) from = {.epoch = message.epoch, .sent = from.sent};
  const bool ours = message.answers_epoch == config_.epoch;
  // The peer returns G itself, and a copy of a double is exact.
  if (ours && (message.given < from.heard || message.taken < from.arrived || message.taken > from.given)) {
    ++refused_;
    return;
  }
  from.sequence = message.sequence;
  from.account = message.account;
  from.need = message.need;
  if (!ours) return;  // totals of a previous pair of epochs
  from.heard = message.given;
  from.arrived = message.taken;
}

void EnergyTank::renew(std::uint64_t epoch) noexcept {
  config_.epoch = epoch;
  for (Peer& peer : peers_) peer = {.sent = peer.sent};
}

void EnergyTank::revalue(std::size_t peer, double joule, double start) noexcept {
  if (peer >= config_.peers) return;
  config_.joule[peer] = joule;
  config_.start = start;
  forgo(peer);
}

void EnergyTank::forgo(std::size_t peer) noexcept {
  if (peer < config_.peers) peers_[peer].credited = peers_[peer].heard;
}

double EnergyTank::take() noexcept {
  double sum = 0;
  for (std::size_t j = 0; j < config_.peers; ++j) {
    sum += (peers_[j].heard - peers_[j].credited) * config_.joule[j];
    peers_[j].credited = peers_[j].heard;
  }
  return sum;
}

double EnergyTank::give(double account, double need) noexcept {
  if (!(account > 0)) return 0;
  std::array<double, kMostPeers> there{};  // Â_j and n_j, in joules of this port
  std::array<double, kMostPeers> needs{};  // 0: receives nothing
  for (std::size_t j = 0; j < config_.peers; ++j) {
    const Peer& peer = peers_[j];
    if (peer.epoch == 0) continue;
    there[j] = peer.account * config_.joule[j] + (peer.given - peer.arrived);
    needs[j] = peer.need * config_.joule[j];
  }
  // All ports below the common ratio are raised to it. Ports above this ratio are excluded.
  double ratio = 0;
  for (std::size_t round = 0; round < config_.peers; ++round) {
    double accounts = account;
    double all_needs = need;
    for (std::size_t j = 0; j < config_.peers; ++j) {
      if (needs[j] > 0) {
        accounts += there[j];
        all_needs += needs[j];
      }
    }
    ratio = accounts / all_needs;
    bool dropped = false;
    for (std::size_t j = 0; j < config_.peers; ++j) {
      if (needs[j] > 0 && ratio * needs[j] <= there[j]) {
        needs[j] = 0;
        dropped = true;
      }
    }
    if (!dropped) break;
  }
  std::array<double, kMostPeers> gifts{};
  double sum = 0;
  for (std::size_t j = 0; j < config_.peers; ++j) {
    if (needs[j] > 0) gifts[j] = std::max(ratio * needs[j] - there[j], 0.0);
    sum += gifts[j];
  }
  const double share = sum > account ? account / sum : 1.0;
  double left = account;
  for (std::size_t j = 0; j < config_.peers; ++j) {
    Peer& peer = peers_[j];
    const double total = std::min(peer.given + std::min(share * gifts[j], left), EnergyTankMessage::kMostTotal);
    // Use the increase of the rounded total, because the peer will compute the same value.
    const double grown = total - peer.given;
    if (!(grown > 0) || grown > left) continue;
    peer.given = total;
    left -= grown;
  }
  return account - left;
}

EnergyTank::Settlement EnergyTank::settle(const Period& period) noexcept {
  Settlement settlement;
  if (!std::isfinite(period.payable) || std::isnan(period.loss)) return settlement;
  allowance_ += config_.max_power * std::max(0.0, seconds(period.elapsed));
  allowance_ = std::min(allowance_, config_.max_account);
  const double came = take();
  settlement.credit = std::min(came, allowance_);
  allowance_ -= settlement.credit;
  double account = period.payable + settlement.credit;
  const double excess = std::max(account - config_.max_account, 0.0);
  account -= excess;
  discarded_ += came - settlement.credit + excess;

  need_ = std::min(std::max(period.loss, 0.0) + config_.start, EnergyTankMessage::kMostAccount);
  const double gift = period.giving ? give(account, need_) : 0.0;
  allowance_ = std::min(allowance_ + gift, config_.max_account);
  account_ = account - gift;
  settlement.withdraw = excess + gift;
  return settlement;
}

EnergyTankMessage EnergyTank::message(std::size_t peer) noexcept {
  if (peer >= config_.peers) return {};
  Peer& to = peers_[peer];
  constexpr double kMost = EnergyTankMessage::kMostAccount;
  return {.epoch = config_.epoch,
          .answers_epoch = to.epoch,
          .sequence = ++to.sent,
          .account = std::clamp(account_, -kMost, kMost),
          .need = need_,
          .given = to.given,
          .taken = to.heard};
}

double EnergyTank::given(std::size_t peer) const noexcept { return peer < config_.peers ? peers_[peer].given : 0; }
double EnergyTank::taken(std::size_t peer) const noexcept { return peer < config_.peers ? peers_[peer].heard : 0; }

}  // namespace tendon
