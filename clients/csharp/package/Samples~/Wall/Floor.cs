// SPDX-License-Identifier: Apache-2.0
using Tendon.Unity;
using UnityEngine;

/// <summary>A floor at the height of the device's middle. Add it to a sphere, which then follows the hand.</summary>
public sealed class Floor : TendonHand {
  [Tooltip("N/m")]
  public float stiffness = 1000;

  protected override HandForce Touch(HandState hand) {
    float depth = -hand.Position.y;
    if (depth <= 0) return default(HandForce);
    return new HandForce { Force = stiffness * depth * Vector3.up, Stiffness = stiffness, Normal = Vector3.up };
  }
}
