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

/// The axes in the frame of the leader that are coupled. The value is "xyz" or a subset of these letters in this order.
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

/// The range for the scales of displacements and forces.
constexpr Number kScale{.least = 0.01, .most = 100};
constexpr Number kShare{.least = 0, .most = 1};

template <class Table>
void declare_map(Table& keys, Draft& draft) {
  PoseMap::Config& map = draft.coupling.map;
  keys.key("position_scale", map.position_scale, kScale, "displacements of the follower over those of the leader");
  keys.key("force_scale", map.force_scale, kScale, "forces at the leader over those at the follower");
  keys.key("rotation_deg", draft.map_rotation, Vector{},
           "rotation vector that turns the leader's base frame into the follower's: about this axis by its length");
  keys.key("axes", map.axes, CoupledAxes{},
           "the axes of the leader's base frame that are coupled; the others are free");
  keys.key(
      "absolute", draft.absolute_map, YesNo{},
      "a place of the leader is a place of the follower, position_scale times as far from the origins of their base "
      "frames: the act aligns the two first. Otherwise places count from where each was at the act");
}

template <class Table>
void declare_coupling(Table& keys, Draft& draft) {
  PositionPosition<3>::Config& spring = draft.coupling.spring;
  keys.key("stiffness_n_per_m", spring.stiffness, kAboveZero,
           "the stiffest that the spring between the handles is, as the leader feels it", kRequired);
  keys.key(
      "damping_n_s_per_m", spring.own_damping, kZeroOrMore,
      "rendered at each handle by itself, as the leader feels it; of waves the impedance, of passivity also the most "
      "that is added. Above 0 for these, and with adapt_to_delay");
  keys.key("mutual_damping_n_s_per_m", spring.damping, kZeroOrMore, "between the handles, beside the spring");
  keys.key("adapt_to_delay", spring.adapt_to_delay, YesNo{},
           "of position-position and set-position: the stiffness is at most twice damping_n_s_per_m over the round "
           "trip, because it "
           "buzzes above");
  keys.key("max_force_n", draft.coupling_force, kAboveZero, "no force of the coupling is longer than this",
           Absent{.text = "force.max_force_n"});
  keys.key("drift_rate_per_s", draft.drift_rate, kZeroOrMore,
           "of passivity: the follower's place is brought to the leader's at this rate, with what energy there is",
           Absent{.text = digits(draft.coupling.drift_rate)});
}

template <class Table>
void declare_rate(Table& keys, RateControl& rate, double& centring) {
  keys.key("dead_zone_mm", rate.dead_zone, kZeroOrMore,
           "the follower stands while the leader's handle is nearer than this to where it engaged", kRequired);
  keys.key("gain_per_s", rate.gain, kAboveZero,
           "speed for each length beyond that, as the leader sees it: times position_scale at the follower", kRequired);
  keys.key("max_speed_mm_per_s", rate.max_speed, kAboveZero, "of the follower, as the leader sees it", kRequired);
  keys.key("centring_n_per_m", centring, kZeroOrMore,
           "of the spring that pulls the leader's handle back. A contact is felt up to what it gives in the dead zone");
}

Names<CouplingMethod> method_names() {
  Names<CouplingMethod> names;
  for (const CouplingMethod method : kCouplingMethods) names.all.emplace_back(to_string(method), method);
  return names;
}

}  // namespace

template <class Table>
void declare_teleoperation(Table& scene, Draft& draft) {
  const Name coupled{"teleoperation", "ties the handle to one of another server"};
  scene.part(coupled, draft.scene.teleoperation, [&draft](Table& keys, Scene::Teleoperation& peer) {
    Coupling::Config& coupling = draft.coupling;
    keys.key("role", coupling.role, Names<PortRole>{{{"leader", PortRole::kLeader}, {"follower", PortRole::kFollower}}},
             "the leader engages and clutches; the follower goes where the leader goes", kRequired);
    keys.key(
        "method", coupling.method, method_names(),
        "position-position: a spring between the handles. waves: one that stays quiet when the way is long. "
        "position-force: the leader feels the contact force that the follower measures. surface: it feels the "
        "surface that the follower found. passivity: it feels the follower's motor, and neither end gives out what "
        "the other has not taken in. set-position: springs to positions that come seldom, stretched as far as the "
        "account pays. rate: its place says how fast the follower moves");
    keys.key("max_delay_ms", coupling.max_delay, kAboveZero,
             "while half of the round trip is longer, the link counts as lost", Absent{.text = "any"});
    keys.key("dial", peer.dial, NetworkAddress{}, "address of the server of the other handle",
             Absent{.text = "that server dials this one"});
    keys.key("key", peer.key, Path{}, "the key file with which this server dials, relative to this file",
             Absent{.text = "in the clear, on this machine only"});
    keys.key("device", peer.device, Label{}, "name of the other handle, of the server that is dialled",
             Absent{.text = "its first device"});
    keys.key("channel", peer.channel, Label{}, "the channel of that device that this server takes",
             Absent{.text = "its first channel"});
    keys.key("on_loss", coupling.holds_place, Names<bool>{{{"release", false}, {"hold", true}}},
             "when nothing comes from the leader. release: the force fades, because a hand holds the handle. hold: a "
             "robot, which stays where it is. Of a follower");
    keys.table("map", [&draft](Table& map) { declare_map(map, draft); });
    keys.table("coupling", [&draft](Table& law) { declare_coupling(law, draft); });
    keys.part("rate", coupling.rate,
              [&coupling](Table& rate, RateControl& config) { declare_rate(rate, config, coupling.centring); });
    keys.part("purse", coupling.purse, [](Table& purse, Purse::Config& config) {
      purse.key("max_account_mj", config.max_account, Number{.least = 0, .most = 1e6, .without_least = true},
                "no account is above this; the rest is discarded");
      purse.key("max_power_w", config.max_power, kAboveZero,
                "the peer's energy is believed up to this power, once max_account_mj has been used up");
    });
    keys.part({"turn", "ties the orientations"}, coupling.turn, [](Table& turn, TurnCoupling::Config& config) {
      turn.key("stiffness_nm_per_rad", config.stiffness, kAboveZero,
               "of the spring that couples the orientations, as the leader feels it", kRequired);
      turn.key("damping_nm_s_per_rad", config.damping, kZeroOrMore,
               "rendered at each handle by itself, as the leader feels it. Above 0 with adapt_to_delay");
    });
    keys.part({"grip", "ties the grippers"}, coupling.grip, [](Table& grip, GripCoupling::Config& config) {
      grip.key("stiffness_n_per_m", config.stiffness, kAboveZero,
               "of the spring that couples the grippers, at the fingers, as the leader feels it", kRequired);
      grip.key("damping_n_s_per_m", config.damping, kZeroOrMore,
               "rendered at each gripper by itself, as the leader feels it. Above 0 with adapt_to_delay");
      grip.key("speed_mm_per_s", config.speed, kAboveZero,
               "so fast do the fingers of the follower go to the opening of the leader's, until they are there");
    });
    keys.part("clutch", coupling.clutch, [](Table& clutch, Coupling::Button& button) {
      clutch.key("button", button.bit, Count{31}, "number of the button that frees the leader's handle", kRequired);
      clutch.key("toggle", button.toggles, YesNo{}, "each press changes it; otherwise as long as it is held");
    });
    keys.table("engage", [&draft, &coupling](Table& engage) {
      engage.key("by", draft.engages_by_button, Names<bool>{{{"request", false}, {"button", true}}},
                 "the leader's act that couples the handles, after a loss too. request: a guest's, or the other "
                 "server's. button: a press");
      engage.key("button", draft.engage_button, Count{31}, "for \"button\": its number",
                 Absent{.text = "required with \"button\""});
      engage.key("ramp_ms", coupling.ramp, kAboveZero, "the force rises from zero for this long");
      engage.key("within_mm", draft.align_within, kAboveZero,
                 "of a leader with map.absolute: so near to the follower's place it engages, once it was for 0.2 s",
                 Absent{.text = Number::shown(unit_of("_mm"), Coupling::Absolute{}.within)});
      engage.key("align_energy_mj", draft.align_energy, Number{.least = 0, .most = 1e6},
                 "of a leader with map.absolute: what its motor may put in by itself at each act, to draw the "
                 "handle there; "
                 "the port gives out so much at most. 0: the hand brings it there");
    });
    keys.tables("leader", peer.leaders, Couplings::kMost, [](Table& leader, Scene::Teleoperation::Leader& one) {
      leader.key("channel", one.channel, Label{}, "of this device, a [[channel]]: the one that this leader takes",
                 kRequired);
      leader.key(
          "share", one.share, kShare,
          "of a follower with several leaders, 2 or more: how much this one counts until a guest says otherwise; "
          "together 1",
          kRequired);
    });
  });
}

template void declare_teleoperation(Reader&, Draft&);
template void declare_teleoperation(Reference&, Draft&);
template void declare_teleoperation(Parts&, Draft&);

}  // namespace tendon::scene_file
