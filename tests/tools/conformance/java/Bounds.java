// SPDX-License-Identifier: Apache-2.0
import java.nio.charset.StandardCharsets;
import tendon.v1.Tendon;

/** The bounds of WIRE.md that concern a client. */
final class Bounds {
  private Bounds() {}

  static final long FARTHEST = 1L << 60;
  private static final double MOST = 1e12;

  static boolean good(double value) {
    return Math.abs(value) <= MOST; // false for NaN
  }

  private static boolean good(Tendon.Vec3 vector) {
    return good(vector.getX()) && good(vector.getY()) && good(vector.getZ());
  }

  /** A unit quaternion. */
  private static boolean good(Tendon.Quat q) {
    double norm = Math.sqrt(q.getW() * q.getW() + q.getX() * q.getX() + q.getY() * q.getY() + q.getZ() * q.getZ());
    return Math.abs(norm - 1) <= 0.001;
  }

  static boolean goodTime(long ns) {
    return ns >= -FARTHEST && ns <= FARTHEST;
  }

  private static boolean goodText(String text, int most) {
    return text.getBytes(StandardCharsets.UTF_8).length <= most;
  }

  static boolean goodCode(int code) {
    return code >= 1 && code <= 9;
  }

  static boolean good(Tendon.DeviceState state) {
    double permitted = state.getPermittedForceN();
    return goodTime(state.getSampledNs())
        && good(state.getPositionM())
        && good(state.getVelocityMps())
        && good(state.getForceAppliedN())
        && good(state.getEnergyJ())
        && permitted >= 0
        && (good(permitted) || Double.isInfinite(permitted))
        && Long.compareUnsigned(state.getForceAgeNs(), FARTHEST) <= 0
        && state.getModeValue() >= 1
        && state.getModeValue() <= 6
        && goodHandle(state);
  }

  /** Fields of the feature "handle"; an absent field is 0, which is valid. */
  private static boolean goodHandle(Tendon.DeviceState state) {
    return (!state.hasOrientation() || good(state.getOrientation()))
        && good(state.getAngularVelocityRadps())
        && good(state.getTorqueAppliedNm())
        && good(state.getGripperRad())
        && good(state.getGripperVelocityRadps())
        && good(state.getGripperForceAppliedN())
        && good(state.getHandForceN());
  }

  static boolean good(Tendon.Bye bye) {
    return goodCode(bye.getCodeValue()) && goodText(bye.getReason(), 128);
  }

  static boolean good(Tendon.Refused refused) {
    return goodCode(refused.getCodeValue()) && goodText(refused.getDetail(), 128);
  }

  /** For a Hello that offers version 1 only. */
  static boolean good(Tendon.Welcome welcome) {
    return welcome.getVersion() == 1
        && welcome.getFeaturesCount() <= 16
        && welcome.getFeaturesList().stream().allMatch(feature -> goodText(feature, 32))
        && (welcome.getRoleValue() == 1 || welcome.getRoleValue() == 2)
        && goodText(welcome.getDeviceName(), 64)
        && goodText(welcome.getServer(), 64)
        && welcome.getMaxForceN() >= 0
        && good(welcome.getMaxForceN())
        && welcome.getPositionResolutionM() >= 0
        && good(welcome.getPositionResolutionM())
        && Integer.compareUnsigned(welcome.getLoopHz() - 1, 1_000_000) < 0
        && Integer.compareUnsigned(welcome.getTimeoutMs() - 1, 3_600_000) < 0;
  }
}
