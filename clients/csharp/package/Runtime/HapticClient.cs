// SPDX-License-Identifier: Apache-2.0
using System;
using System.Diagnostics;
using System.Net;
using System.Net.Sockets;
using System.Threading;

namespace Tendon {
  /// <summary>Computes the force on the hand for a state. `force` is cleared before; what is not set is not sent.
  /// </summary>
  public delegate void Physics(DeviceState hand, ForceCommand force);

  /// <summary>
  /// A force client with a UDP socket. It reconnects until it is refused for good.
  ///
  ///     using (var client = new HapticClient("127.0.0.1:47100", new Config { Name = "spring" }))
  ///         client.Run((hand, force) => force.Force = -500 * hand.Position, () => false);
  ///
  /// Or, with a loop of its own (a game engine): Start, then TryTake and Send at any rate. A turn does not allocate.
  /// All members but Run are thread-safe.
  /// </summary>
  public sealed class HapticClient : IDisposable {
    private const long NextAddressAfter = Time.Second;
    private const long SilenceAfter = 3 * Time.Second;
    private const int WaitMs = 10; // for a datagram. Socket.Poll waits ten times too long in Mono
    private const int MostAtOnce = 64; // so that a flood does not keep the engine waiting
    private readonly string _server;
    private readonly Config _config;
    private readonly ForceClient _client;
    private readonly object _lock = new object();
    private readonly IPAddress[] _addresses;
    private readonly int _port;
    private int _address;
    private int _moves; // to another address since the last answer
    private Socket _socket;
    private readonly byte[] _received = new byte[2048]; // more than a datagram, to notice longer ones
    private readonly byte[] _sent = new byte[Header.Largest];
    private Thread _thread;
    private volatile bool _ending;

    /// <summary>Throws an ArgumentException with the reason if the address or a value of the config is wrong, if the
    /// name has no address that can be reached, or if a key is needed.</summary>
    public HapticClient(string server, Config config) {
      int colon = server.LastIndexOf(':');
      if (colon <= 0 || !ushort.TryParse(server.Substring(colon + 1), out ushort port) || port == 0) {
        throw new ArgumentException($"the server is \"{server}\", expected HOST:PORT, for example 127.0.0.1:47100");
      }
      _client = new ForceClient(config);
      _config = config;
      _server = server;
      _port = port;
      _addresses = AddressesOf(server.Substring(0, colon).Trim('[', ']'));
      if (config.Key == null && !Array.TrueForAll(_addresses, IPAddress.IsLoopback)) {
        throw new ArgumentException($"{server} is another machine: a key is needed (tendond keygen NAME)");
      }
      while (_socket == null) {
        try {
          _socket = Connected();
        } catch (SocketException error) {
          if (++_address == _addresses.Length) throw new ArgumentException($"cannot reach {server}: {error.Message}");
        }
      }
    }

    private static IPAddress[] AddressesOf(string name) {
      try {
        IPAddress[] addresses = Dns.GetHostAddresses(name);
        if (addresses.Length > 0) return addresses;
      } catch (SocketException) {
        // is the same as no address
      }
      throw new ArgumentException($"the name {name} has no address");
    }

    /// <summary>Text for the user: why there is no session. Empty if there is one.</summary>
    public string Status {
      get {
        lock (_lock) {
          if (_client.Phase == Phase.Open) return "";
          if (_client.Unanswered(Now()) < SilenceAfter) return _client.Reason;
          string key = _config.Key == null ? "" : ", and does it have this key";
          return $"no answer from {_server}: is tendond running there{key}?";
        }
      }
    }

    public Phase Phase {
      get {
        lock (_lock) return _client.Phase;
      }
    }

    public LinkStats Stats {
      get {
        lock (_lock) return _client.Stats;
      }
    }

    /// <summary>Calls a function with the client, for its other members. The client must not be kept, and the function
    /// must not call Close.</summary>
    public Result With<Result>(Func<ForceClient, Result> function) {
      lock (_lock) return function(_client);
    }

    /// <summary>Answers each new state in this thread until `isOver` returns true, or the client is refused for good or
    /// replaced. Returns the reason, and sends the Byes.</summary>
    public string Run(Physics physics, Func<bool> isOver) {
      var hand = new DeviceState();
      var force = new ForceCommand();
      while (!isOver() && Phase != Phase.Ended) {
        Turn();
        if (!TryTake(hand)) continue;
        force.Clear();
        physics(hand, force);
        if (!_config.Observe) Send(hand, force);
      }
      string reason = Phase == Phase.Ended ? Status : "the program ended";
      Close(reason);
      return reason;
    }

    /// <summary>Starts a thread that keeps the session, for TryTake and Send.</summary>
    public void Start() {
      if (_thread != null) throw new InvalidOperationException("the client was started before");
      _thread = new Thread(() => {
        while (!_ending) Turn();
      }) { IsBackground = true, Name = "tendon" };
      _thread.Start();
    }

    /// <summary>Copies the newest state. Returns false if there is none that was not taken before.</summary>
    public bool TryTake(DeviceState into) {
      lock (_lock) return _client.TakeState(into);
    }

    /// <summary>Sends a force immediately (ForceClient.Send).</summary>
    public string Send(DeviceState answered, ForceCommand force) {
      lock (_lock) {
        string objection = _client.Send(answered, force);
        if (objection == null) SendDue();
        return objection;
      }
    }

    /// <summary>Ends the session with a Bye, and the thread.</summary>
    public void Close(string reason) {
      _ending = true;
      if (_thread != null && _thread != Thread.CurrentThread) _thread.Join();
      lock (_lock) {
        if (_socket == null) return;
        if (_client.Phase != Phase.Ended) _client.Close(reason);
        SendDue();
        _socket.Close();
        _socket = null;
      }
    }

    public void Dispose() => Close("the client was disposed");

    /// <summary>Sends what is due, waits for a datagram, and handles those that have arrived.</summary>
    private void Turn() {
      Socket socket;
      lock (_lock) {
        SendDue();
        long silence = _client.Unanswered(Now());
        if (silence == 0) _moves = 0;
        if (_addresses.Length > 1 && silence > NextAddressAfter * (1 + _moves)) UseNextAddress();
        socket = _socket;
      }
      if (socket == null) return;
      int count;
      SocketError error;
      try {
        count = socket.Receive(_received, 0, _received.Length, SocketFlags.None, out error);
      } catch (ObjectDisposedException) {
        return; // Close was called meanwhile
      }
      if (error == SocketError.ConnectionRefused || error == SocketError.ConnectionReset) {
        Thread.Sleep(WaitMs); // the answer to an earlier datagram, which is treated as lost
        return;
      }
      if (error != SocketError.Success) return; // mostly TimedOut
      lock (_lock) {
        if (_socket != socket) return;
        _client.Receive(Now(), _received, count);
        for (int i = 1; i < MostAtOnce && error == SocketError.Success; ++i) {
          if (_socket != socket || socket.Available == 0) break; // the callback of a request may have closed it
          count = socket.Receive(_received, 0, _received.Length, SocketFlags.None, out error);
          if (error == SocketError.Success) _client.Receive(Now(), _received, count);
        }
        SendDue();
      }
    }

    private void SendDue() {
      if (_socket == null) return;
      for (int count; (count = _client.NextDatagram(Now(), _sent)) > 0;) {
        _socket.Send(_sent, 0, count, SocketFlags.None, out SocketError _);
      }
    }

    private void UseNextAddress() {
      ++_moves;
      _address = (_address + 1) % _addresses.Length;
      try {
        Socket next = Connected();
        _socket.Close();
        _socket = next;
      } catch (SocketException) {
        // there is no route to this address; the next one follows after another second
      }
    }

    private Socket Connected() {
      var socket = new Socket(_addresses[_address].AddressFamily, SocketType.Dgram, ProtocolType.Udp);
      socket.Connect(new IPEndPoint(_addresses[_address], _port));
      socket.ReceiveTimeout = WaitMs;
      return socket;
    }

    /// <summary>ns of the monotonic clock.</summary>
    private static long Now() {
      long ticks = Stopwatch.GetTimestamp();
      long seconds = ticks / Stopwatch.Frequency, rest = ticks % Stopwatch.Frequency;
      return seconds * Time.Second + rest * Time.Second / Stopwatch.Frequency;
    }
  }
}
