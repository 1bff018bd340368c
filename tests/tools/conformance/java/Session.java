// SPDX-License-Identifier: Apache-2.0
import com.google.protobuf.InvalidProtocolBufferException;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.util.Arrays;
import java.util.BitSet;
import java.util.function.BiConsumer;
import tendon.v1.Tendon;

/** The client side of an open session (SESSION.md). Has no socket or clock; the caller passes the time. */
final class Session {
  private static final long MS = 1_000_000;
  private static final long KEEP_ALIVE = 50 * MS;
  private static final long TIMEOUT = 2_000 * MS;
  private static final long OVERLAP = 2_000 * MS;
  private static final long KEY_AGE = 600_000 * MS;
  private static final long KEY_DATAGRAMS = 1 << 20;
  private static final long LIFE = 24 * 3600 * 1000L * MS;
  private static final int REMEMBERED = 1984;
  private static final int RING = 2048;

  private final int connection;
  private final Aead aead; // null in suite 0
  private final int suite;
  private final long opened;

  // Sending.
  private byte[] sendKey;
  private int sendEpoch;
  private long sealed;
  private long keySince;
  private long next;
  private Long lastSent;
  private long sequence;
  private Tendon.DeviceState unanswered; // the newest state, if no force has answered it yet
  private boolean asked = true; // the only request: id 1, 500 states per second
  private long askAt;
  private int timesAsked;

  // Receiving.
  private byte[] receiveKey;
  private byte[] previousKey;
  private int receiveEpoch;
  private long movedOn;
  private long highest = -1;
  private final BitSet seen = new BitSet(RING);
  private long lastHeard;
  private long echoNumber = -1; // of the newest accepted datagram
  private long echoSent;
  private long echoAt;
  private Long newestTick;

  // RFC 6298.
  private long smoothed;
  private long variation;

  /** Why the session ended; null while it is open. */
  String end;

  int endCode;

  /** In suite 0. */
  Session(int connection, long now) {
    this(connection, null, null, now);
  }

  Session(int connection, Aead aead, Noise.Keys keys, long now) {
    this.connection = connection;
    this.aead = aead;
    suite = aead == null ? 0 : aead.suite;
    opened = now;
    lastHeard = now;
    keySince = now;
    askAt = now;
    if (keys == null) return;
    sendKey = keys.clientToServer();
    receiveKey = keys.serverToClient();
  }

  // ---- In ----

  void receive(long now, byte[] datagram) {
    if (end != null || datagram.length < Opening.HEADER || datagram.length > Opening.LARGEST) return;
    ByteBuffer header = ByteBuffer.wrap(datagram).order(ByteOrder.LITTLE_ENDIAN);
    long number = header.getLong(8);
    if (datagram[0] != 0x54 || datagram[1] != 0x13 || datagram[3] != suite || header.getInt(4) != connection) return;
    if (number < 0 || number >= 1L << 60 || contains(number)) return;
    byte[] body = aead == null ? Arrays.copyOfRange(datagram, Opening.HEADER, datagram.length) : open(now, datagram, number);
    if (body == null) return;
    Tendon.Datagram content = parse(body);
    if (content == null) {
      if (aead != null) insert(number);
      return;
    }
    if (number > echoNumber) {
      echoNumber = number;
      echoSent = content.getTxTimeNs();
      echoAt = now;
    }
    insert(number);
    lastHeard = now;
    if (content.hasEcho()) observe(now, content);
    for (Tendon.Frame frame : content.getFramesList()) take(frame);
  }

  private static Tendon.Datagram parse(byte[] body) {
    try {
      Tendon.Datagram content = Tendon.Datagram.parseFrom(body);
      return content.getFramesCount() <= 64 && Bounds.goodTime(content.getTxTimeNs()) ? content : null;
    } catch (InvalidProtocolBufferException notADatagram) {
      return null;
    }
  }

  private byte[] open(long now, byte[] datagram, long number) {
    if (previousKey != null && now - movedOn >= OVERLAP) previousKey = null;
    int ahead = (datagram[2] - receiveEpoch) & 0xFF;
    byte[] key = ahead == 0 ? receiveKey : ahead == 1 ? aead.renewed(receiveKey) : ahead == 0xFF ? previousKey : null;
    if (key == null) return null;
    byte[] body = aead.open(key, number, Arrays.copyOf(datagram, Opening.HEADER), datagram, Opening.HEADER);
    if (body != null && ahead == 1) {
      previousKey = receiveKey;
      receiveKey = key;
      receiveEpoch = (receiveEpoch + 1) & 0xFF;
      movedOn = now;
    }
    return body;
  }

  private boolean contains(long number) {
    if (number > highest) return false;
    return highest - number >= REMEMBERED || seen.get((int) (number % RING));
  }

  private void insert(long number) {
    if (number > highest) {
      long from = Math.max(highest + 1, number - RING + 1);
      for (long i = from; i <= number; ++i) seen.clear((int) (i % RING));
      highest = number;
    }
    seen.set((int) (number % RING));
  }

  private void observe(long now, Tendon.Datagram content) {
    Tendon.Echo echo = content.getEcho();
    boolean possible =
        Long.compareUnsigned(echo.getPeerPacketNumber(), next) < 0
            && echo.getPeerTxTimeNs() >= opened
            && echo.getPeerTxTimeNs() <= now
            && Bounds.goodTime(echo.getRxTimeNs())
            && echo.getRxTimeNs() <= content.getTxTimeNs();
    if (!possible) return;
    long sample = (now - echo.getPeerTxTimeNs()) - (content.getTxTimeNs() - echo.getRxTimeNs());
    if (sample < 0) return;
    variation = smoothed == 0 ? sample / 2 : (3 * variation + Math.abs(smoothed - sample)) / 4;
    smoothed = smoothed == 0 ? sample : (7 * smoothed + sample) / 8;
  }

  private void take(Tendon.Frame frame) {
    if (frame.hasState() && Bounds.good(frame.getState())) {
      long tick = frame.getState().getTick();
      if (newestTick != null && Long.compareUnsigned(tick, newestTick) <= 0) return;
      newestTick = tick;
      unanswered = frame.getState();
    } else if (frame.hasControlAck()) {
      if (frame.getControlAck().getId() == 1) asked = false;
    } else if (frame.hasBye() && Bounds.good(frame.getBye())) {
      endCode = frame.getBye().getCodeValue();
      end = frame.getBye().getReason();
    }
  }

  void tick(long now) {
    if (end != null) return;
    if (now - lastHeard >= TIMEOUT) end = "nothing received for 2 s";
    if (aead != null && now - opened >= LIFE) end = "the session has reached its maximum age";
  }

  // ---- Out ----

  /** Returns the next due datagram, or null. `physics` answers the newest state with a force and optionally a torque. */
  byte[] nextDatagram(long now, BiConsumer<Tendon.DeviceState, Tendon.ForceCommand.Builder> physics) {
    if (end != null) return null;
    boolean askNow = asked && now >= askAt;
    boolean silent = lastSent == null || now - lastSent >= KEEP_ALIVE;
    if (unanswered == null && !askNow && !silent) return null;
    Tendon.Datagram.Builder body = begin(now);
    if (unanswered != null) {
      Tendon.ForceCommand.Builder force =
          Tendon.ForceCommand.newBuilder()
              .setSequence(++sequence)
              .setBasedOnTick(unanswered.getTick())
              .setValidForUs(20_000);
      physics.accept(unanswered, force);
      body.addFrames(Tendon.Frame.newBuilder().setForce(force));
      unanswered = null;
    }
    if (askNow) {
      Tendon.Control.Builder control =
          Tendon.Control.newBuilder().setId(1).setSetStateRate(Tendon.SetStateRate.newBuilder().setHz(500));
      body.addFrames(Tendon.Frame.newBuilder().setControl(control));
      long first = smoothed == 0 ? 100 * MS : Math.max(20 * MS, smoothed + 4 * variation);
      askAt = now + Math.max(first, Math.min(1000 * MS, first << Math.min(timesAsked++, 6)));
    }
    return finish(now, body);
  }

  byte[] bye(long now) {
    Tendon.Bye bye = Tendon.Bye.newBuilder().setCode(Tendon.Code.CODE_OK).setReason("asked to end").build();
    return finish(now, begin(now).addFrames(Tendon.Frame.newBuilder().setBye(bye)));
  }

  private Tendon.Datagram.Builder begin(long now) {
    Tendon.Datagram.Builder body = Tendon.Datagram.newBuilder().setTxTimeNs(now);
    if (echoNumber < 0) return body;
    int mask = 0;
    for (int i = 0; i < 32 && i < echoNumber; ++i) {
      if (seen.get((int) ((echoNumber - 1 - i) % RING))) mask |= 1 << i;
    }
    return body.setEcho(
        Tendon.Echo.newBuilder()
            .setPeerTxTimeNs(echoSent)
            .setRxTimeNs(echoAt)
            .setPeerPacketNumber(echoNumber)
            .setReceivedMask(mask));
  }

  private byte[] finish(long now, Tendon.Datagram.Builder body) {
    lastSent = now;
    if (aead == null) return Noise.join(Opening.header(3, 0, suite, connection, next++), body.build().toByteArray());
    if (sealed >= KEY_DATAGRAMS || now - keySince >= KEY_AGE) {
      sendKey = aead.renewed(sendKey);
      sendEpoch = (sendEpoch + 1) & 0xFF;
      sealed = 0;
      keySince = now;
    }
    ++sealed;
    byte[] header = Opening.header(3, sendEpoch, suite, connection, next);
    return Noise.join(header, aead.seal(sendKey, next++, header, body.build().toByteArray()));
  }

  long waitNs(long now) {
    if (lastSent == null || unanswered != null) return 0;
    long due = Math.min(lastSent + KEEP_ALIVE, lastHeard + TIMEOUT);
    return (asked ? Math.min(due, askAt) : due) - now;
  }
}
