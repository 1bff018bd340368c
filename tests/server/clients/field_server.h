// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/scene.h"
#include "tests/server/servers.h"
#include "tests/support/dice.h"
#include "tests/support/field_engine.h"
#include "tests/support/field_shape.h"

namespace tendon {

/// A server with devices that render fields, all loops and any engines, in virtual time behind a bad network.
class FieldServer : public Servers {
 protected:
  struct Engine {
    std::unique_ptr<End> end;
    std::unique_ptr<FieldEngine> engine;
    FieldEngine* operator->() const { return engine.get(); }
  };

  /// `more` is the rest of the scene, after [device].
  static Scene scene_of(const std::string& more, const std::string& name = "left") {
    return device_named(name, "[device.hand]\nstiffness_n_per_m = 300\ndamping_n_s_per_m = 3\n" + more);
  }

  void start(const std::vector<Scene>& scenes, const std::vector<ClientKey>& keys = {}, std::size_t networks = 1) {
    Assembly::Config config;
    records_ = scenes.front().recording.has_value();
    if (!records_) config.watched = Mailboxes::Capacities{.steps = 16, .flight = 2, .datagrams = 1};
    config.network.secret.fill(std::byte{7});
    config.network.keys = keys;
    serve(scenes, networks, config);
    least_energy_ = 0;
  }

  Engine engine(const std::string& address, FieldEngine::Config config = {}) {
    config.seed = ++seed_;
    Engine one{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    one.engine = std::make_unique<FieldEngine>(*one.end, server_, config, now_);
    return one;
  }
  static FieldEngine::Config with_key(const ClientKey& key) {
    FieldEngine::Config config;
    config.hello.name = key.name;
    config.hello.role = key.role;
    config.key = key.key;
    return config;
  }
  static FieldEngine::Config claiming(const std::string& channel, const std::string& device = "left") {
    FieldEngine::Config config;
    config.hello.claims = {{.device = device, .channel = channel, .role = Role::kController}};
    return config;
  }

  void run(Duration length, const std::vector<const Engine*>& engines, const std::function<void()>& each = {}) {
    for (const LocalTime until = now_ + length; now_ < until; now_ += std::chrono::milliseconds(1)) {
      step();
      for (const Engine* one : engines) (*one)->turn(now_);
      for (; count_ < wire_.size(); ++count_) {
        if (dice_.chance(loss_)) continue;
        const int copies = dice_.chance(duplicates_) ? 2 : 1;
        for (int i = 0; i < copies; ++i)
          under_way_.emplace_back(now_ + way_ + dice_.milliseconds(0, jitter_ms_), wire_[count_]);
      }
      std::erase_if(under_way_, [&](const auto& one) {
        if (one.first > now_) return false;
        deliver(one.second, engines);
        return true;
      });
      if (each) each();
    }
  }
  /// Returns the answer to the request, or an answer with the code kTimedOut if none arrives.
  FieldEngine::Answer answer_to(std::uint32_t id, const Engine& asker) {
    for (int i = 0; i < 200 && asker->answer(id) == nullptr; ++i) run(std::chrono::milliseconds(10), {&asker});
    const auto* const answer = asker->answer(id);
    return answer != nullptr ? *answer : FieldEngine::Answer{.id = id, .code = Code::kTimedOut, .detail = {}};
  }
  /// Uploads a shape. Returns false if this takes longer than 10 s.
  bool upload(const Engine& to, const FieldShape& shape) {
    const FieldSender& sender = to->upload(shape);
    for (int i = 0; i < 1000 && !sender.complete(); ++i) run(std::chrono::milliseconds(10), {&to});
    return sender.complete();
  }
  const FieldName& newest(const Engine& one) { return one->uploads.back().field(); }

  std::vector<std::string> notices(std::size_t network = 0) {
    std::vector<std::string> said;
    for (const auto& notice : assembly_->network(network).take_notices()) said.push_back(notice.text);
    return said;
  }
  bool said(const std::string& words) {
    const auto all = notices();
    return std::ranges::any_of(all, [&](const std::string& one) { return one.find(words) != std::string::npos; });
  }

  Dice dice_{7};
  Duration way_{};
  double jitter_ms_ = 0;
  double loss_ = 0;
  double duplicates_ = 0;
  std::function<void(const StepRecord&)> watch_;  ///< of the first device
  std::function<void()> after_haptics_;           ///< between the haptic and the network loops
  StepRecord last_;
  double least_energy_ = 0;

 private:
  void step() {
    for (auto& group : assembly_->haptic_groups()) group.turn(now_);
    if (after_haptics_) after_haptics_();
    for (std::size_t i = 0; i < assembly_->networks(); ++i) assembly_->turn_network(i, now_);
    if (records_) assembly_->log().turn(now_, 0);
    for (std::size_t i = 0; i < assembly_->devices().size() && !records_; ++i) {
      while (const StepRecord* const record = mail(i).steps.front()) {
        least_energy_ = std::min(least_energy_, record->energy);
        if (i == 0) last_ = *record;
        if (i == 0 && watch_) watch_(*record);
        mail(i).steps.pop();
      }
    }
  }
  void deliver(const Datagram& datagram, const std::vector<const Engine*>& engines) {
    if (datagram.to == server_) {
      const auto header = decode_header(datagram.bytes);
      const bool of_session = header && header->type == DatagramType::kData;
      ends_[of_session ? header->connection_id % ends_.size() : 0].inbox.push_back(datagram);
      return;
    }
    for (const Engine* one : engines) {
      if (datagram.to == one->end->self) one->end->inbox.push_back(datagram);
    }
  }

  bool records_ = false;  ///< by the LogLoop. `watch_` is not called then
  std::uint64_t seed_ = 0;
  std::size_t count_ = 0;
  std::vector<std::pair<LocalTime, Datagram>> under_way_;
};

}  // namespace tendon
