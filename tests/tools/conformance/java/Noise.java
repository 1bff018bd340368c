// SPDX-License-Identifier: Apache-2.0
import java.io.ByteArrayOutputStream;
import java.math.BigInteger;
import java.nio.charset.StandardCharsets;
import java.security.GeneralSecurityException;
import java.security.InvalidKeyException;
import java.security.KeyFactory;
import java.security.MessageDigest;
import java.security.PrivateKey;
import java.security.PublicKey;
import java.security.spec.NamedParameterSpec;
import java.security.spec.XECPrivateKeySpec;
import java.security.spec.XECPublicKeySpec;
import java.util.Arrays;
import javax.crypto.KeyAgreement;
import javax.crypto.Mac;
import javax.crypto.spec.SecretKeySpec;

/**
 * The initiator of Noise_NNpsk0_25519_ChaChaPoly_SHA256, with the JDK's own primitives (11 or newer). Each object makes
 * one attempt and writes message 1 once.
 */
final class Noise {
  /** A key for each direction. */
  record Keys(byte[] clientToServer, byte[] serverToClient) {
    /** Returns the keys of suite 2, from the output of Split() and h after message 2. */
    Keys ofSuite2(byte[] hash) {
      byte[] label = ascii("tendon-suite-2");
      return new Keys(hmac(clientToServer, label, hash), hmac(serverToClient, label, hash));
    }
  }

  /** `hash`: h after message 2. */
  record Opened(byte[] payload, Keys keys, byte[] hash) {}

  private final byte[] ephemeral;
  private final State state = new State();
  private final byte[] message;

  Noise(byte[] psk, byte[] ephemeral, byte[] prologue, byte[] payload) {
    this.ephemeral = ephemeral;
    state.hash = ascii("Noise_NNpsk0_25519_ChaChaPoly_SHA256");
    state.hash = sha256(state.hash); // the name is longer than a hash
    state.chain = state.hash;
    state.mixHash(prologue);
    state.mixKeyAndHash(psk);
    byte[] mine = x25519(ephemeral, basePoint());
    state.mixHash(mine);
    state.mixKey(mine);
    message = join(mine, state.encryptAndHash(payload));
  }

  byte[] message() {
    return message;
  }

  /** Reads message 2; null unless authentic. A later message may be. */
  Opened read(byte[] answer) {
    if (answer.length < 32 + Aead.TAG) return null;
    State next = state.copy();
    byte[] theirs = Arrays.copyOf(answer, 32);
    next.mixHash(theirs);
    next.mixKey(theirs);
    byte[] shared = x25519(ephemeral, theirs);
    if (shared == null) return null;
    next.mixKey(shared);
    byte[] payload = Aead.CHACHA_POLY.open(next.key, 0, next.hash, answer, 32);
    if (payload == null) return null;
    next.mixHash(Arrays.copyOfRange(answer, 32, answer.length));
    byte[][] keys = hkdf(next.chain, new byte[0], 2);
    return new Opened(payload, new Keys(keys[0], keys[1]), next.hash);
  }

  private static final class State {
    byte[] hash;
    byte[] chain;
    byte[] key;

    State copy() {
      State out = new State();
      out.hash = hash;
      out.chain = chain;
      out.key = key;
      return out;
    }

    void mixHash(byte[] data) {
      hash = sha256(hash, data);
    }

    void mixKey(byte[] material) {
      byte[][] out = hkdf(chain, material, 2);
      chain = out[0];
      key = out[1];
    }

    void mixKeyAndHash(byte[] material) {
      byte[][] out = hkdf(chain, material, 3);
      chain = out[0];
      mixHash(out[1]);
      key = out[2];
    }

    byte[] encryptAndHash(byte[] text) {
      byte[] sealed = Aead.CHACHA_POLY.seal(key, 0, hash, text);
      mixHash(sealed);
      return sealed;
    }
  }

  // ---- The primitives, under the names of the documents ----

  static byte[] sha256(byte[]... pieces) {
    try {
      MessageDigest digest = MessageDigest.getInstance("SHA-256");
      for (byte[] piece : pieces) digest.update(piece);
      return digest.digest();
    } catch (GeneralSecurityException error) {
      throw new IllegalStateException(error);
    }
  }

  static byte[] hmac(byte[] key, byte[]... pieces) {
    try {
      Mac mac = Mac.getInstance("HmacSHA256");
      mac.init(new SecretKeySpec(key, "HmacSHA256"));
      for (byte[] piece : pieces) mac.update(piece);
      return mac.doFinal();
    } catch (GeneralSecurityException error) {
      throw new IllegalStateException(error);
    }
  }

  private static byte[][] hkdf(byte[] chain, byte[] material, int count) {
    byte[] secret = hmac(chain, material);
    byte[][] out = new byte[count][];
    byte[] before = new byte[0];
    for (int i = 0; i < count; ++i) {
      out[i] = hmac(secret, before, new byte[] {(byte) (i + 1)});
      before = out[i];
    }
    return out;
  }

  private static byte[] basePoint() {
    byte[] out = new byte[32];
    out[0] = 9;
    return out;
  }

  /** Null if the result is 32 zeros. */
  static byte[] x25519(byte[] scalar, byte[] point) {
    try {
      byte[] bigEndian = new byte[32];
      for (int i = 0; i < 32; ++i) bigEndian[i] = point[31 - i];
      bigEndian[0] &= 0x7F;
      KeyFactory factory = KeyFactory.getInstance("X25519");
      PrivateKey secret = factory.generatePrivate(new XECPrivateKeySpec(NamedParameterSpec.X25519, scalar));
      PublicKey theirs =
          factory.generatePublic(new XECPublicKeySpec(NamedParameterSpec.X25519, new BigInteger(1, bigEndian)));
      KeyAgreement agreement = KeyAgreement.getInstance("X25519");
      agreement.init(secret);
      agreement.doPhase(theirs, true);
      return agreement.generateSecret();
    } catch (InvalidKeyException lowOrder) {
      return null;
    } catch (GeneralSecurityException error) {
      throw new IllegalStateException(error);
    }
  }

  static byte[] ascii(String text) {
    return text.getBytes(StandardCharsets.US_ASCII);
  }

  static byte[] join(byte[]... pieces) {
    ByteArrayOutputStream out = new ByteArrayOutputStream();
    for (byte[] piece : pieces) out.writeBytes(piece);
    return out.toByteArray();
  }
}
