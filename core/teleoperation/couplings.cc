// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/couplings.h"

#include <algorithm>
#include <utility>

#include "core/base/expect.h"

namespace tendon {

namespace {

std::vector<Coupling> couplings_of(const Coupling::Config& config, std::span<const CoupledLeader> leaders) {
  expect(leaders.size() != 1 && leaders.size() <= Couplings::kMost, "leaders", static_cast<double>(leaders.size()),
         "none, or 2 to 4");
  expect(leaders.empty() || (!config.turn && !config.grip), "leaders", static_cast<double>(leaders.size()),
         "none with coupled orientations or grippers");
  std::vector<Coupling> all;
  if (leaders.empty()) all.emplace_back(config);
  for (const CoupledLeader& leader : leaders) {
    Coupling::Config one = config;
    one.share = leader.share;
    all.emplace_back(one);
  }
  return all;
}

Shares shares_of(std::span<const CoupledLeader> leaders) {
  std::vector<double> shares;
  for (const CoupledLeader& leader : leaders) shares.push_back(leader.share);
  if (shares.empty()) shares.push_back(1);
  return Shares(shares);
}

}  // namespace

Couplings::Couplings(const Coupling::Config& config, std::span<const CoupledLeader> leaders)
    : all_(couplings_of(config, leaders)), shares_(shares_of(leaders)) {}

void Couplings::observe(const Interval<3>& interval, double payable) noexcept {
  for (Coupling& one : all_) one.observe(interval, payable);
}

void Couplings::share(LocalTime now) noexcept {
  shares_.advance(began_ ? now - now_ : Duration::zero());
  now_ = now;
  began_ = true;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    double others = 0;
    for (std::size_t j = 0; j < all_.size(); ++j) others = j == i ? others : std::max(others, all_[j].gain());
    all_[i].set_share(shares_[i], others);
  }
}

Demand<3> Couplings::command(const Motion& hand, std::uint32_t buttons, bool ready,
                             const HandleSample* handle) noexcept {
  if (all_.size() > 1) share(hand.at);
  Demand<3> sum = all_.front().command(hand, buttons, ready, handle);
  for (std::size_t i = 1; i < all_.size(); ++i) {
    const Demand<3> demand = all_[i].command(hand, buttons, ready);
    sum.force += demand.force;
    sum.stiffness += demand.stiffness;
  }
  return sum;
}

void Couplings::command_unseen(LocalTime now, bool ready) noexcept {
  if (all_.size() > 1) share(now);
  for (Coupling& one : all_) one.command_unseen(now, ready);
  settled_ = {};
}

EnergyTank::Settlement Couplings::settle(double payable, double loss, Duration elapsed) noexcept {
  EnergyTank::Settlement sum;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    settled_[i] = all_[i].settle(payable + sum.credit - sum.withdraw, loss, elapsed);
    sum.credit += settled_[i].credit;
    sum.withdraw += settled_[i].withdraw;
  }
  return sum;
}

bool Couplings::live() const noexcept {
  return std::any_of(all_.begin(), all_.end(), [](const Coupling& one) { return one.live(); });
}

}  // namespace tendon
