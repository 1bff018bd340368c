// SPDX-License-Identifier: Apache-2.0
import com.google.protobuf.InvalidProtocolBufferException;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.security.SecureRandom;
import java.util.Arrays;
import tendon.v1.Tendon;

/** One connection attempt, which repeats Hello until it is answered. Has no socket or clock; the caller passes the time. */
final class Opening {
  static final int HEADER = 16;
  static final int LARGEST = 1200;
  private static final long REPEAT_NS = 100_000_000;
  private static final String AES = "aes-256-gcm"; // the feature that offers and selects suite 2

  private final int suite;
  private final byte[] random = new byte[16];
  private final byte[] body;
  private final Noise noise;
  private byte[] cookie;
  private boolean due = true;
  private long saidAt;

  /** The answer, if received: one of the two. */
  Tendon.Refused refused;
  Session session;

  /** `key` is null in suite 0. */
  Opening(byte[] key, SecureRandom source) {
    Tendon.Hello.Builder hello =
        Tendon.Hello.newBuilder()
            .setVersionMin(1)
            .setVersionMax(1)
            .setRole(Tendon.Role.ROLE_CONTROLLER)
            .setName("spring.java")
            .addFeatures("handle");
    suite = key == null ? 0 : 1;
    source.nextBytes(random);
    if (key == null) {
      noise = null;
      body = hello.build().toByteArray();
      return;
    }
    hello.addFeatures(AES);
    byte[] ephemeral = new byte[32];
    source.nextBytes(ephemeral);
    byte[] keyId = Arrays.copyOf(Noise.sha256(Noise.ascii("tendon-key-id"), key), 8);
    byte[] prologue = Noise.join(Noise.ascii("tendon-1"), header(1, 0, suite, 0, 0), keyId, random);
    noise = new Noise(key, ephemeral, prologue, hello.build().toByteArray());
    body = Noise.join(keyId, noise.message());
  }

  static byte[] header(int type, int epoch, int suite, int connection, long number) {
    return ByteBuffer.allocate(HEADER)
        .order(ByteOrder.LITTLE_ENDIAN)
        .put((byte) 0x54)
        .put((byte) (1 << 4 | type))
        .put((byte) epoch)
        .put((byte) suite)
        .putInt(connection)
        .putLong(number)
        .array();
  }

  /** Returns the Hello if it is due, else null. */
  byte[] nextDatagram(long now) {
    if (!due && now - saidAt < REPEAT_NS) return null;
    due = false;
    saidAt = now;
    return ByteBuffer.allocate(LARGEST)
        .order(ByteOrder.LITTLE_ENDIAN)
        .put(header(1, 0, suite, 0, 0))
        .put(random)
        .put(cookie == null ? new byte[16] : cookie)
        .putShort((short) body.length)
        .put(body)
        .array();
  }

  long waitNs(long now) {
    return due ? 0 : saidAt + REPEAT_NS - now;
  }

  void receive(long now, byte[] datagram) {
    if (datagram.length < 32 || datagram.length > LARGEST || datagram[0] != 0x54 || datagram[3] != suite) return;
    if (!Arrays.equals(datagram, 16, 32, random, 0, 16)) return;
    if (datagram[1] == 0x12 && datagram.length == 48) {
      due = due || cookie == null; // only the first Retry is answered immediately
      cookie = Arrays.copyOfRange(datagram, 32, 48);
    } else if (datagram[1] == 0x14) {
      settle(now, datagram);
    }
  }

  private void settle(long now, byte[] datagram) {
    byte[] bytes = Arrays.copyOfRange(datagram, 32, datagram.length);
    Noise.Opened opened = null;
    if (noise != null) {
      opened = noise.read(bytes);
      if (opened == null) return;
      bytes = opened.payload();
    }
    Tendon.Answer answer;
    try {
      answer = Tendon.Answer.parseFrom(bytes);
    } catch (InvalidProtocolBufferException notAnAnswer) {
      return;
    }
    int connection = ByteBuffer.wrap(datagram).order(ByteOrder.LITTLE_ENDIAN).getInt(4);
    if (answer.hasRefused() && Bounds.good(answer.getRefused())) {
      refused = answer.getRefused();
    } else if (answer.hasWelcome() && Bounds.good(answer.getWelcome())) {
      if (opened == null) {
        session = new Session(connection, now);
      } else if (answer.getWelcome().getFeaturesList().contains(AES)) {
        session = new Session(connection, Aead.AES_GCM, opened.keys().ofSuite2(opened.hash()), now);
      } else {
        session = new Session(connection, Aead.CHACHA_POLY, opened.keys(), now);
      }
    }
  }
}
