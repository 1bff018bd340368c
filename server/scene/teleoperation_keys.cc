// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>

#include "server/scene/keys.h"
#include "server/scene/parts.h"
#include "server/scene/reader.h"
#include "server/scene/reference.h"
#include "server/scene/values.h"

namespace tendon::scene_file {
namespace {

/// The coupled axes in the frame of the leader, as "xyz" or a subset of these letters in this order.
struct CoupledAxes {
  static constexpr std::string_view kLetters = "xyz";

  static std::string expected(const Unit&) { return "one or more of the letters x, y, z, in this order"; }

  static Verdict take(const toml::node& node, const Unit& unit, std::array<bool, 3>& to) {
    const auto* text = node.as_string();
    if (text == nullptr || (*text)->empty()) return Refusal{&node, expected(unit)};
    std::array<bool, 3> axes{};
    std::size_t next = 0;
    for (const char letter : **text) {
      const std::size_t axis = kLetters.find(letter);
      if (axis == std::string_view::npos || axis < next) return Refusal{&node, expected(unit)};
      axes[axis] = true;
      next = axis + 1;
    }
    to = axes;
    return {};
  }

  static std::string shown(const Unit&, const std::array<bool, 3>& axes) {
    std::string text;
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      if (axes[axis]) text += kLetters[axis];
    }
    return in_quotes(text);
  }
};

constexpr Number kScale{.least = 0.01, .most = 100};  ///< of displacements and forces
constexpr Number kShare{.least = 0, .most = 1};

template <class Table>
void declare_map(Table& keys, Draft& draft) {
  PoseMap::Config& map = draft.coupling.map;
  keys.key("position_scale", map.position_scale, kScale, "Displacement of the follower divided by that of the leader");
  keys.key("force_scale", map.force_scale, kScale, "Force at the leader divided by that at the follower");
  keys.key("rotation_deg", draft.map_rotation, Vector{},
           "Rotation from the leader's base frame to the follower's, as a rotation vector: the direction is the axis, "
           "the length is the angle");
  keys.key("axes", map.axes, CoupledAxes{},
           "Axes of the leader's base frame that are coupled. The other axes are free");
  keys.key("absolute", draft.absolute_map, YesNo{},
           "Couple absolute positions: the position of the follower is that of the leader times position_scale, each "
           "in its base frame. Before the coupling engages, the leader's handle is moved to the position of the "
           "follower. false: each position is relative to the one at which the coupling engaged");
}

template <class Table>
void declare_coupling(Table& keys, Draft& draft) {
  PositionPosition<3>::Config& spring = draft.coupling.spring;
  keys.key("stiffness_n_per_m", spring.stiffness, kAboveZero,
           "Maximum stiffness of the spring between the handles, as felt at the leader", kRequired);
  keys.key("damping_n_s_per_m", spring.own_damping, kZeroOrMore,
           "Damping of each handle, as felt at the leader. For waves, this is the wave impedance. For passivity, it is "
           "also the maximum added damping. Must be above 0 for these methods and with adapt_to_delay");
  keys.key("mutual_damping_n_s_per_m", spring.damping, kZeroOrMore,
           "Damping between the handles, parallel to the spring");
  keys.key("adapt_to_delay", spring.adapt_to_delay, YesNo{},
           "For position-position and set-position: limit the stiffness to twice damping_n_s_per_m divided by the "
           "round-trip time. A stiffer coupling oscillates");
  keys.key("max_force_n", draft.coupling_force, kAboveZero, "Maximum length of the force vector of the coupling",
           Absent{.text = "force.max_force_n"});
  keys.key("drift_rate_per_s", draft.drift_rate, kZeroOrMore,
           "For passivity: rate at which the position of the follower converges to that of the leader, as far as there "
           "is energy",
           Absent{.text = digits(draft.coupling.drift_rate)});
}

template <class Table>
void declare_rate(Table& keys, RateControl& rate, double& centring) {
  keys.key(
      "dead_zone_mm", rate.dead_zone, kZeroOrMore,
      "Distance of the leader's handle from the position at which it engaged, below which the follower stands still",
      kRequired);
  keys.key("gain_per_s", rate.gain, kAboveZero,
           "Speed per distance beyond the dead zone, in lengths of the leader. The follower moves position_scale times "
           "as fast",
           kRequired);
  keys.key("max_speed_mm_per_s", rate.max_speed, kAboveZero, "Maximum speed of the follower, in lengths of the leader",
           kRequired);
  keys.key("centring_n_per_m", centring, kZeroOrMore,
           "Stiffness of the spring that pulls the leader's handle back to the position at which it engaged. Contact "
           "forces are felt up to the force of this spring in the dead zone");
}

Names<CouplingMethod> method_names() {
  Names<CouplingMethod> names;
  for (const CouplingMethod method : kCouplingMethods) names.all.emplace_back(to_string(method), method);
  return names;
}

std::string methods_in_words() {
  std::string text;
  for (const CouplingMethodInfo& row : coupling_methods::kRows) {
    text += (text.empty() ? "" : ". ") + std::string(row.name) + ": " + std::string(row.what);
  }
  return text;
}

}  // namespace

template <class Table>
void declare_teleoperation(Table& scene, Draft& draft) {
  const Name coupled{"teleoperation", "couples the handle to one of another server"};
  scene.part(coupled, draft.scene.teleoperation, [&draft](Table& keys, Scene::Teleoperation& peer) {
    Coupling::Config& coupling = draft.coupling;
    keys.key("role", coupling.role, Names<PortRole>{{{"leader", PortRole::kLeader}, {"follower", PortRole::kFollower}}},
             "The leader engages the coupling and can use the clutch. The follower follows the leader", kRequired);
    keys.key("method", coupling.method, method_names(), methods_in_words());
    keys.key("max_delay_ms", coupling.max_delay, kAboveZero,
             "Maximum one-way delay. While half of the round-trip time is longer, the connection is treated as lost",
             Absent{.text = "any"});
    keys.key("dial", peer.dial, NetworkAddress{}, "Address of the server of the other handle",
             Absent{.text = "the other server connects to this one"});
    keys.key("key", peer.key, Path{}, "Key file for the connection to the other server, relative to this file",
             Absent{.text = "not encrypted; only for a server on this machine"});
    keys.key("device", peer.device, Label{}, "Name of the device at the other server",
             Absent{.text = "its first device"});
    keys.key("channel", peer.channel, Label{}, "Channel of that device that this server uses",
             Absent{.text = "its first channel"});
    keys.key("on_loss", coupling.holds_place, Names<bool>{{{"release", false}, {"hold", true}}},
             "What a follower does if it receives nothing from the leader. release: the force decays, for a handle "
             "that is held by a hand. hold: the follower holds its position, for a robot");
    keys.table("map", [&draft](Table& map) { declare_map(map, draft); });
    keys.table("coupling", [&draft](Table& law) { declare_coupling(law, draft); });
    keys.part("rate", coupling.rate,
              [&coupling](Table& rate, RateControl& config) { declare_rate(rate, config, coupling.centring); });
    keys.part("energy_tank", coupling.tank, [](Table& tank, EnergyTank::Config& config) {
      tank.key("max_account_mj", config.max_account, Number{.least = 0, .most = 1e6, .without_least = true},
               "Maximum energy in each account. Further energy is discarded");
      tank.key("max_power_w", config.max_power, kAboveZero,
               "Maximum average power at which energy from the peer is accepted, after the first max_account_mj");
    });
    keys.part({"turn", "couples the orientations"}, coupling.turn, [](Table& turn, TurnCoupling::Config& config) {
      turn.key("stiffness_nm_per_rad", config.stiffness, kAboveZero,
               "Angular stiffness between the handles, as felt at the leader", kRequired);
      turn.key("damping_nm_s_per_rad", config.damping, kZeroOrMore,
               "Angular damping of each handle, as felt at the leader. Must be above 0 with adapt_to_delay");
    });
    keys.part({"grip", "couples the grippers"}, coupling.grip, [](Table& grip, GripCoupling::Config& config) {
      grip.key("stiffness_n_per_m", config.stiffness, kAboveZero,
               "Stiffness between the grippers, at the fingers, as felt at the leader", kRequired);
      grip.key("damping_n_s_per_m", config.damping, kZeroOrMore,
               "Damping of each gripper, as felt at the leader. Must be above 0 with adapt_to_delay");
      grip.key(
          "speed_mm_per_s", config.speed, kAboveZero,
          "Speed at which the fingers of the follower move to the opening of the leader when the coupling is engaged");
    });
    keys.part("clutch", coupling.clutch, [](Table& clutch, Coupling::Button& button) {
      clutch.key("button", button.bit, Count{31},
                 "Number of the button that disconnects the leader's handle from the follower", kRequired);
      clutch.key("toggle", button.toggles, YesNo{},
                 "Each press opens or closes the clutch. Otherwise, it is open while the button is held");
    });
    keys.table("engage", [&draft, &coupling](Table& engage) {
      engage.key("by", draft.engages_by_button, Names<bool>{{{"request", false}, {"button", true}}},
                 "How the leader engages the coupling, also after a loss of the connection. request: by a request from "
                 "a client or from the other server. button: by pressing a button");
      engage.key("button", draft.engage_button, Count{31}, "For \"button\": its number",
                 Absent{.text = "required with \"button\""});
      engage.key("ramp_ms", coupling.ramp, kAboveZero, "Time in which the force increases from zero");
      engage.key("within_mm", draft.align_within, kAboveZero,
                 "For a leader with map.absolute: distance from the position of the follower within which the handle "
                 "must be for 0.2 s before the coupling engages",
                 Absent{.text = Number::shown(unit_of("_mm"), Coupling::Absolute{}.within)});
      engage.key(
          "align_energy_mj", draft.align_energy, Number{.least = 0, .most = 1e6},
          "For a leader with map.absolute: maximum energy with which its motors may move the handle to the position of "
          "the follower, each time the coupling is engaged. 0: the operator must move the handle there");
    });
    keys.tables("leader", peer.leaders, Couplings::kMost, [](Table& leader, Scene::Teleoperation::Leader& one) {
      leader.key("channel", one.channel, Label{}, "Name of the [[channel]] of this device that this leader uses",
                 kRequired);
      leader.key("share", one.share, kShare,
                 "Initial share of this leader in the motion of the follower, which a client can change. The shares of "
                 "all leaders must add up to 1. At least 2 leaders",
                 kRequired);
    });
  });
}

template void declare_teleoperation(Reader&, Draft&);
template void declare_teleoperation(Reference&, Draft&);
template void declare_teleoperation(Parts&, Draft&);

}  // namespace tendon::scene_file
