// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_session.h"

#include <algorithm>
#include <utility>

namespace tendon::dash {

template <class Which>
void FoxgloveSession::erase_data(Which which) {
  std::erase_if(data_, [&](const Waiting& one) {
    if (!which(one)) return false;
    bytes_ -= one.bytes.size();
    return true;
  });
}

bool FoxgloveSession::subscribe(std::uint32_t subscription, std::uint32_t channel) {
  const bool taken = std::ranges::any_of(subscription_of_, [&](const auto& one) { return one.second == subscription; });
  return !taken && subscription_of_.try_emplace(channel, subscription).second;
}

bool FoxgloveSession::unsubscribe(std::uint32_t subscription) {
  erase_data([&](const Waiting& one) { return one.subscription == subscription; });
  return std::erase_if(subscription_of_, [&](const auto& one) { return one.second == subscription; }) > 0;
}

void FoxgloveSession::forget(std::uint32_t channel) {
  const auto found = subscription_of_.find(channel);
  if (found != subscription_of_.end()) unsubscribe(found->second);
}

void FoxgloveSession::put(std::uint32_t channel, UnixTime at, std::string_view payload) {
  const auto found = subscription_of_.find(channel);
  if (found == subscription_of_.end()) return;
  data_.push_back({found->second, at, message_data(found->second, at, payload)});
  bytes_ += data_.back().bytes.size();
  while (bytes_ > kMaxBytes) {
    const UnixTime tenth = data_.front().at / kDropped;
    const std::size_t before = data_.size();
    erase_data([&](const Waiting& one) { return one.at / kDropped == tenth; });
    dropped_ += before - data_.size();
  }
}

std::optional<FoxgloveSession::Message> FoxgloveSession::next() {
  if (dropped_ > 0) {
    const std::string count = std::to_string(std::exchange(dropped_, 0));
    return Message{status_text(StatusLevel::kWarning, "slow",
                               "This viewer does not read fast enough: " + count + " messages were dropped."),
                   false};
  }
  if (!texts_.empty()) {
    Message text{std::move(texts_.front()), false};
    texts_.pop_front();
    return text;
  }
  if (server_state_) return Message{*std::exchange(server_state_, std::nullopt), false};
  if (data_.empty()) return std::nullopt;
  Message data{std::move(data_.front().bytes), true};
  data_.pop_front();
  bytes_ -= data.bytes.size();
  return data;
}

}  // namespace tendon::dash
