// SPDX-License-Identifier: Apache-2.0
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.security.GeneralSecurityException;
import java.security.spec.AlgorithmParameterSpec;
import java.util.Arrays;
import javax.crypto.AEADBadTagException;
import javax.crypto.Cipher;
import javax.crypto.spec.GCMParameterSpec;
import javax.crypto.spec.IvParameterSpec;
import javax.crypto.spec.SecretKeySpec;

/** The ciphers for Data, with the nonce and key renewal of each (WIRE.md). */
enum Aead {
  CHACHA_POLY(1),
  AES_GCM(2);

  static final int TAG = 16;

  /** The number of the cipher suite in headers. */
  final int suite;

  Aead(int suite) {
    this.suite = suite;
  }

  byte[] seal(byte[] key, long number, byte[] associated, byte[] text) {
    try {
      return cipher(Cipher.ENCRYPT_MODE, key, number, associated).doFinal(text);
    } catch (GeneralSecurityException error) {
      throw new IllegalStateException(error);
    }
  }

  /** Decrypts `bytes` from index `at` on; null unless authentic. */
  byte[] open(byte[] key, long number, byte[] associated, byte[] bytes, int at) {
    if (bytes.length - at < TAG) return null;
    try {
      return cipher(Cipher.DECRYPT_MODE, key, number, associated).doFinal(bytes, at, bytes.length - at);
    } catch (AEADBadTagException forged) {
      return null;
    } catch (GeneralSecurityException error) {
      throw new IllegalStateException(error);
    }
  }

  /** The next key of a direction. */
  byte[] renewed(byte[] key) {
    return Arrays.copyOf(seal(key, -1, new byte[0], new byte[32]), 32);
  }

  private Cipher cipher(int mode, byte[] key, long number, byte[] associated) throws GeneralSecurityException {
    boolean aes = this == AES_GCM;
    ByteOrder order = aes ? ByteOrder.BIG_ENDIAN : ByteOrder.LITTLE_ENDIAN;
    byte[] nonce = ByteBuffer.allocate(12).order(order).putInt(0).putLong(number).array();
    AlgorithmParameterSpec parameters = aes ? new GCMParameterSpec(8 * TAG, nonce) : new IvParameterSpec(nonce);
    Cipher cipher = Cipher.getInstance(aes ? "AES/GCM/NoPadding" : "ChaCha20-Poly1305");
    cipher.init(mode, new SecretKeySpec(key, aes ? "AES" : "ChaCha20"), parameters);
    cipher.updateAAD(associated);
    return cipher;
  }
}
