// SPDX-License-Identifier: Apache-2.0
// tendon-bridge ros2: publishes a device as ROS 2 topics, with plain DDS.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/bridge/ros2/ros2_device.h"
#include "clients/bridge/ros2/ros2_node.h"
#include "clients/bridge/subcommands.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/stop_signals.h"
#include "clients/cpp/usage.h"

namespace tendon::bridge {
namespace {

struct Ros2Options {
  BridgeConfig bridge;
  std::uint32_t domain = 0;
  std::string interface;
  std::vector<std::string> peers;
  double rate_hz = 0;
  bool negate = false;
  bool crtk = false;
  bool negate_measured = false;
  std::optional<RosServo::Kind> servo;
  std::string clutch;
  double servo_scale = 1;
  std::string servo_frame;
  double duration_s = std::numeric_limits<double>::infinity();
};

constexpr Duration kDiagnosticsEvery = std::chrono::seconds(1);
/// Commands are only read at this interval. Only the newest command of an interval is used.
constexpr Duration kLeastGap = std::chrono::microseconds(250);

/// Rejects characters with a meaning in XML, because the text becomes part of the Cyclone DDS configuration.
std::string host_or_interface(const std::string& text) {
  const auto fits = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           std::string_view("._:-@").find(c) != std::string_view::npos;
  };
  return !text.empty() && text.size() <= 255 && std::ranges::all_of(text, fits)
             ? std::string()
             : "expected the name of an interface, a host name or an IP address, got \"" + text + "\"";
}

Duration since_1970() {
  const auto system = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<Duration>(system) - read_clock().time_since_epoch();
}

class Ros2Bridge {
 public:
  explicit Ros2Bridge(const Ros2Options& options)
      : options_(options), host_(options.bridge, read_clock()), node_(config(options, host_)) {
    for (std::size_t i = 0; i < host_.size(); ++i) {
      RosDevice::Config of_device{.name = ros_name(host_.name(i)),
                                  .rate_hz = options.rate_hz,
                                  .negate = options.negate,
                                  .clutch = options.clutch,
                                  .crtk = options.crtk,
                                  .negate_measured = options.negate_measured};
      if (options.servo) {
        const std::string frame = options.servo_frame.empty() ? of_device.name + "_servo" : options.servo_frame;
        of_device.servo.emplace(*options.servo, options.servo_scale, frame);
      }
      devices_.emplace_back(host_.device(i), std::move(of_device));
    }
  }

  int run() {
    const StopSignals signals;
    say_what_it_is();
    LocalTime now = read_clock();
    const LocalTime end = options_.duration_s < 1e9 ? now + from_seconds(options_.duration_s) : LocalTime::max();
    LocalTime next_diagnosis = now + kDiagnosticsEvery;
    LocalTime next_take = now;
    bool rings = true;
    for (; !signals.asked() && now < end; now = read_clock()) {
      const std::array<BridgeHost::Count, 4> counts = {{{"published", node_.published()},
                                                        {"unsent", node_.unsent()},
                                                        {"superseded", node_.superseded()},
                                                        {"refused", refused()}}};
      LocalTime next = std::min({turn(now, counts), next_diagnosis, end});
      if (rings && take(now)) {
        next_take = now + kLeastGap;
        next = std::min(next, turn(now, counts));
      }
      publish(now);
      if (now >= next_diagnosis) {
        diagnose(now);
        next_diagnosis = now + kDiagnosticsEvery;
      }
      std::array<pollfd, 1> bell = {{{node_.descriptor(), POLLIN, 0}}};
      const bool listens = now >= next_take;
      host_.wait(std::span(bell).first(listens ? 1 : 0), now, listens ? next : std::min(next, next_take));
      rings = bell[0].revents != 0;
    }
    return host_.stop(read_clock());
  }

 private:
  /// Turns until nothing is due. A force computed in one turn is sent in the next.
  LocalTime turn(LocalTime now, std::span<const BridgeHost::Count> counts) {
    LocalTime next = now;
    for (int turns = 0; next <= now && turns < 4; ++turns) next = host_.turn(now, counts);
    return next;
  }

  static Ros2Node::Config config(const Ros2Options& options, const BridgeHost& host) {
    Ros2Node::Config config{.domain = options.domain,
                            .interface = options.interface,
                            .peers = options.peers,
                            .devices = {},
                            .servo = options.servo,
                            .crtk = options.crtk};
    std::map<std::string, std::string> taken;
    for (std::size_t i = 0; i < host.size(); ++i) {
      const std::string name = ros_name(host.name(i));
      const auto [other, fresh] = taken.emplace(name, host.name(i));
      if (!fresh) {
        throw std::runtime_error("--device " + host.name(i) + ": its ROS name would be " + name +
                                 ", which is already used for " + other->second);
      }
      config.devices.push_back(name);
    }
    return config;
  }

  void say_what_it_is() {
    std::string sentence = "wrench_command is the force on the hand";
    if (options_.negate) {
      sentence = "--negate: wrench_command is the force on a robot or of the hand, and its opposite acts on the hand";
    }
    host_.say(sentence + "; the topic wrench is always the force of the device on the hand");
    if (options_.crtk) {
      host_.say(std::string("--crtk: servo_cf is the force on the hand; measured_cf is the force of the ") +
                (options_.negate_measured ? "hand on the device" : "device on the hand"));
    }
    if (!options_.interface.empty()) {
      host_.say("--interface " + options_.interface + ": anyone who can reach DDS domain " +
                std::to_string(options_.domain) + " on this interface can move the motors");
    }
    if (options_.bridge.json) {
      const nlohmann::ordered_json line = {{"event", "listening"},
                                           {"address", "domain " + std::to_string(options_.domain)}};
      std::cout << line << std::endl;
    }
  }

  bool take(LocalTime now) {
    node_.clear();
    bool asked = false;
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      if (const auto writers = node_.writers_if_changed(i)) devices_[i].keep(*writers);
      for (const RosInput& input : node_.take(i)) {
        devices_[i].take(input, now);
        asked = true;
      }
      while (const auto sentence = devices_[i].next_sentence()) host_.say(host_.name(i) + ": " + *sentence);
    }
    return asked;
  }

  void publish(LocalTime now) {
    const Duration offset = since_1970();
    for (std::size_t i = 0; i < devices_.size(); ++i) node_.publish(i, devices_[i].messages(now, offset));
  }

  void diagnose(LocalTime now) {
    std::vector<RosDiagnosis> diagnoses;
    for (RosDevice& device : devices_) diagnoses.push_back(device.diagnosis());
    node_.publish(diagnoses, ros_time(now.time_since_epoch() + since_1970()));
  }

  std::uint64_t refused() const {
    std::uint64_t all = 0;
    for (const RosDevice& device : devices_) all += device.refused();
    return all;
  }

  Ros2Options options_;
  BridgeHost host_;
  Ros2Node node_;
  std::deque<RosDevice> devices_;
};

}  // namespace

void add_ros2(CLI::App& app, Chosen& chosen) {
  static Ros2Options o;  // must exist until the chosen subcommand has run
  CLI::App& ros2 = *app.add_subcommand("ros2", "Publish a device as ROS 2 topics with DDS: /tendon/NAME/pose, …");
  ros2.footer(
      "Example: tendon-bridge ros2 --server lab:47100 --device right\n"
      "Example: tendon-bridge ros2 --server lab:47100 --device right --servo twist --clutch 0\n"
      "Example: tendon-bridge ros2 --server lab:47100 --device right --crtk");
  o.bridge.client.joints = true;
  o.bridge.client.diagnostics = true;
  add_common(ros2, o.bridge);
  ros2.add_option("--domain", o.domain, "ROS_DOMAIN_ID")
      ->envname("ROS_DOMAIN_ID")
      ->check(CLI::Range(0U, Ros2Node::kMaxDomain))
      ->capture_default_str();
  const CLI::Validator host(host_or_interface, "");
  ros2.add_option("--interface", o.interface, "Network interface. Default: only this machine")
      ->type_name("NAME")
      ->check(host);
  ros2.add_option("--peer", o.peers, "With --interface: a machine that cannot be reached by multicast, repeatable")
      ->type_name("HOST")
      ->check(host)
      ->needs("--interface");
  ros2.add_option("--rate", o.rate_hz, "Maximum number of states per second. 0: all")
      ->type_name("HZ")
      ->check(CLI::Range(0.0, 10000.0));
  ros2.add_flag("--negate", o.negate, "Negate wrench_command, if it is the force on a robot or the force of the hand");
  ros2.add_flag("--negate-measured", o.negate_measured,
                "With --crtk: measured_cf is the force of the hand on the device")
      ->needs(ros2.add_flag("--crtk", o.crtk, "Also publish the topics of CRTK: /NAME/measured_cp, …"));
  const std::map<std::string, RosServo::Kind> kinds = {{"twist", RosServo::Kind::kTwist},
                                                       {"pose", RosServo::Kind::kPose}};
  ros2.add_option("--servo", o.servo, "Also send the motion of the hand to a robot arm while the clutch is held")
      ->transform(usage::one_of(kinds))
      ->needs(ros2.add_option("--clutch", o.clutch, "Name or number of the clutch button")->type_name("BUTTON"));
  ros2.add_option("--servo-scale", o.servo_scale, "Motion of the robot divided by that of the hand")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  ros2.add_option("--servo-frame", o.servo_frame, "frame_id of the messages to the arm. Default: NAME_servo")
      ->type_name("FRAME");
  ros2.add_option("--duration-s", o.duration_s, "End after this time")->check(CLI::PositiveNumber);
  ros2.callback([&chosen] {
    o.bridge.always_observe = o.crtk;
    chosen = [] { return Ros2Bridge(o).run(); };
  });
}

}  // namespace tendon::bridge
