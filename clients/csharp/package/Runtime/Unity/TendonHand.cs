// SPDX-License-Identifier: Apache-2.0
using System;
using UnityEngine;

namespace Tendon.Unity {
  /// <summary>The hand at the device, in the frame of Unity, meters and seconds.</summary>
  public struct HandState {
    public Vector3 Position;
    public Vector3 Velocity;

    /// <summary>The force that the device exerts on the hand, N. See Reasons if it is not what was asked for.</summary>
    public Vector3 ForceApplied;

    /// <summary>The identity if the device does not measure its orientation.</summary>
    public Quaternion Rotation;

    /// <summary>rad/s, by Unity's left-hand rule.</summary>
    public Vector3 AngularVelocity;

    /// <summary>Bit i is set if button i is pressed, or was pressed since the last call.</summary>
    public uint Buttons;

    /// <summary>Bits of the reasons in protocol/WIRE.md.</summary>
    public uint Reasons;
  }

  /// <summary>The answer. All zeros: no force.</summary>
  public struct HandForce {
    /// <summary>On the hand, N. A floor pushes up.</summary>
    public Vector3 Force;

    /// <summary>N/m: by how much the force decreases when the hand moves along +x, +y and +z, or only along Normal if
    /// that is set. The device updates the force with it a thousand times a second, which keeps a wall stable at 50
    /// answers per second. Leave it out for a force that does not depend on the position.</summary>
    public float Stiffness;

    /// <summary>The direction in which the stiffness acts, of length 1. Zero: in all directions.</summary>
    public Vector3 Normal;

    /// <summary>On the hand, N·m, by Unity's left-hand rule. Only for devices that can exert torques.</summary>
    public Vector3 Torque;
  }

  /// <summary>
  /// A haptic hand. Derive a component, override Touch, and press Play:
  ///
  ///     public sealed class Spring : TendonHand
  ///     {
  ///         protected override HandForce Touch(HandState hand) =>
  ///             new HandForce { Force = -300 * hand.Position, Stiffness = 300 };
  ///     }
  ///
  /// Touch is called in FixedUpdate, once for each new state at most. The socket has a thread of its own, so that the
  /// session lives while the game is paused: forces then stop, and the server fades the last one within 0.3 s after
  /// validForSeconds. OnDisable ends the session. An exception in Touch is logged and disables the component.
  /// </summary>
  public abstract class TendonHand : MonoBehaviour {
    [Tooltip("HOST:PORT of tendond")]
    public string server = "127.0.0.1:47100";

    [Tooltip("Path of the key file. Needed if the server is another machine")]
    public string keyFile = "";

    [Tooltip("Name of the device, or empty for the first one")]
    public string device = "";

    [Tooltip("Name of the channel, or empty for the first one")]
    public string channel = "";

    [Tooltip("For how long a force is valid. At least three times Time.fixedDeltaTime")]
    public float validForSeconds = 0.06f;

    [Tooltip("States that the server sends per second. 0: every one, which are 1000 on most devices")]
    public uint statesPerSecond = 200;

    [Tooltip("Move this GameObject with the hand, relative to its parent")]
    public bool moves = true;

    private readonly DeviceState _state = new DeviceState();
    private readonly ForceCommand _force = new ForceCommand();
    private HapticClient _client;
    private UnityFrame _frame = UnityFrame.Identity;
    private HandleDescription _handle;
    private string _status = "";
    private Func<ForceClient, HandleDescription> _handleOf; // made once, so that FixedUpdate does not allocate
    private Func<ForceClient, bool> _awaitsHandle;

    /// <summary>Returns the force on the hand.</summary>
    protected abstract HandForce Touch(HandState hand);

    /// <summary>Why there is no session; empty if there is one.</summary>
    public string Status => _client == null ? "the component is disabled" : _client.Status;

    /// <summary>The client, for requests and statistics; null while the component is disabled.</summary>
    protected HapticClient Client => _client;

    protected virtual void OnEnable() {
      _handleOf = client => client.Handle;
      _awaitsHandle = client => client.AwaitsHandle;
      try {
        var config = new Config { Name = NameOf(name), Device = device, Channel = channel, RateHz = statesPerSecond };
        config.ValidForUs = (uint)(Mathf.Clamp(validForSeconds, 1e-6f, 10) * 1e6f);
        if (keyFile != "") config.Key = KeyFile.Load(keyFile);
        _client = new HapticClient(server, config);
        _client.Start();
      } catch (Exception error) {
        Debug.LogError($"Tendon: {error.Message}", this);
        enabled = false;
      }
    }

    /// <summary>Returns at most 63 bytes of UTF-8, because a client's name has at most 64.</summary>
    private static string NameOf(string name) => name.Length <= 21 ? name : name.Substring(0, 21);

    protected virtual void OnDisable() {
      _client?.Close("the component was disabled");
      _client = null;
      _handle = null;
      _frame = UnityFrame.Identity;
    }

    protected virtual void FixedUpdate() {
      if (_client == null) return;
      if (_client.With(_awaitsHandle) || !_client.TryTake(_state)) {
        TellStatus();
        return;
      }
      UseHandle(_client.With(_handleOf));
      HandState hand = Hand();
      if (moves) transform.localPosition = hand.Position;
      if (moves) transform.localRotation = hand.Rotation;
      HandForce force;
      try {
        force = Touch(hand);
      } catch (Exception error) {
        Debug.LogException(error, this);
        enabled = false;
        return;
      }
      Answer(force);
    }

    private HandState Hand() => new HandState {
      Position = _frame.Vector(_state.Position),
      Velocity = _frame.Vector(_state.Velocity),
      ForceApplied = _frame.Vector(_state.ForceApplied),
      Rotation = _state.Orientation.HasValue ? _frame.Rotation(_state.Orientation.Value) : Quaternion.identity,
      AngularVelocity = _frame.Axial(_state.AngularVelocity),
      Buttons = _state.Buttons,
      Reasons = _state.Reasons,
    };

    private void Answer(HandForce force) {
      _force.Clear();
      _force.Force = _frame.Vector(force.Force);
      if (force.Torque != Vector3.zero) _force.Torque = _frame.Axial(force.Torque);
      if (force.Stiffness != 0) {
        _force.HasModel = true;
        _force.Model.At = _state.Position;
        if (force.Normal == Vector3.zero) _force.Model.Stiffness.Set(force.Stiffness);
        else _force.Model.Stiffness.SetAlong(_frame.Vector(force.Normal), force.Stiffness);
      }
      string objection = _client.Send(_state, _force);
      if (objection != null) Tell(objection);
    }

    /// <summary>The description arrives after the session opens. Until then, the axes are not known, and Touch is not
    /// called.</summary>
    private void UseHandle(HandleDescription handle) {
      if (handle == null || handle == _handle) return;
      _handle = handle;
      _frame = handle.OperatorFromDevice.HasValue
        ? new UnityFrame(handle.OperatorFromDevice.Value)
        : UnityFrame.Identity;
    }

    private void TellStatus() {
      string status = _client.Status;
      if (status != "") Tell(status);
    }

    /// <summary>Logs a text once until it changes.</summary>
    private void Tell(string text) {
      if (text == _status) return;
      _status = text;
      Debug.LogWarning($"Tendon: {text}", this);
    }
  }
}
