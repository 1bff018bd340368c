// SPDX-License-Identifier: Apache-2.0
import java.io.IOException;
import java.net.InetSocketAddress;
import java.net.PortUnreachableException;
import java.nio.ByteBuffer;
import java.nio.channels.DatagramChannel;
import java.nio.channels.SelectionKey;
import java.nio.channels.Selector;
import java.nio.file.Files;
import java.nio.file.Path;
import java.nio.file.attribute.PosixFilePermission;
import java.security.SecureRandom;
import java.util.Arrays;
import java.util.EnumSet;
import java.util.HexFormat;
import java.util.Set;
import tendon.v1.Tendon;

/**
 * A spring of 500 N/m toward the origin, and one of 0.1 N·m/rad that turns the handle upright if the
 * device measures its orientation.
 *
 * <pre>java -cp tendon-spring.jar:/usr/share/java/protobuf.jar Spring 127.0.0.1:47100 [wall.key]</pre>
 */
public final class Spring {
  private static final double STIFFNESS = 500; // N/m
  private static final double ANGULAR_STIFFNESS = 0.1; // N·m/rad
  private static volatile boolean ending;

  private final byte[] key;
  private final SecureRandom source = new SecureRandom();
  private final DatagramChannel channel = DatagramChannel.open();
  private final Selector selector = Selector.open();

  private Spring(InetSocketAddress server, byte[] key) throws IOException {
    this.key = key;
    channel.connect(server);
    channel.configureBlocking(false);
    channel.register(selector, SelectionKey.OP_READ);
  }

  public static void main(String[] arguments) throws IOException {
    if (arguments.length < 1 || arguments.length > 2 || arguments[0].startsWith("-")) {
      System.err.println("usage: Spring HOST:PORT [KEY_FILE]     Example: Spring 127.0.0.1:47100");
      System.exit(2);
    }
    int colon = arguments[0].lastIndexOf(':');
    InetSocketAddress server =
        new InetSocketAddress(arguments[0].substring(0, colon), Integer.parseInt(arguments[0].substring(colon + 1)));
    Spring spring = new Spring(server, arguments.length == 2 ? readKey(Path.of(arguments[1])) : null);
    Thread main = Thread.currentThread();
    // On SIGTERM and Ctrl-C the JVM waits for this thread, which waits until the Byes are sent.
    Runtime.getRuntime()
        .addShutdownHook(
            new Thread(
                () -> {
                  ending = true;
                  spring.selector.wakeup();
                  try {
                    main.join(1000);
                  } catch (InterruptedException hurried) {
                    Thread.currentThread().interrupt();
                  }
                }));
    String refusal = spring.run();
    if (refusal == null) return;
    System.err.println("refused: " + refusal);
    Runtime.getRuntime().halt(1);
  }

  /** Runs until asked to end or refused. Returns the reason. */
  private String run() throws IOException {
    Opening opening = new Opening(key, source);
    Session session = null;
    while (!ending) {
      long now = System.nanoTime();
      if (session == null) {
        send(opening.nextDatagram(now));
      } else {
        session.tick(now);
        send(session.nextDatagram(now, Spring::pull));
      }
      now = System.nanoTime();
      long wait = session == null ? opening.waitNs(now) : session.waitNs(now);
      if (wait > 0) {
        selector.select(Math.max(1, wait / 1_000_000));
        selector.selectedKeys().clear();
      }
      byte[] datagram;
      while ((datagram = receive()) != null) {
        now = System.nanoTime();
        if (session != null) {
          session.receive(now, datagram);
        } else {
          opening.receive(now, datagram);
          if (opening.refused != null) return opening.refused.getDetail();
          session = opening.session;
        }
      }
      if (session != null && session.end != null) {
        System.err.println("the session is over: " + session.end);
        if (session.endCode == Tendon.Code.CODE_REPLACED_VALUE) return session.end;
        session = null;
        opening = new Opening(key, source);
      }
    }
    for (int i = 0; session != null && i < 3; ++i) send(session.bye(System.nanoTime()));
    return null;
  }

  private static void pull(Tendon.DeviceState hand, Tendon.ForceCommand.Builder answer) {
    Tendon.Vec3 at = hand.getPositionM();
    answer.setForceN(times(-STIFFNESS, at.getX(), at.getY(), at.getZ()));
    if (!hand.hasOrientation()) return; // the server has not granted "handle"
    Tendon.Quat q = hand.getOrientation();
    answer
        .setTorqueNm(times(-2 * ANGULAR_STIFFNESS * q.getW(), q.getX(), q.getY(), q.getZ()))
        .setRotationModel(
            Tendon.RotationModel.newBuilder().setAtOrientation(q).addAngularStiffnessNmprad(ANGULAR_STIFFNESS));
  }

  private static Tendon.Vec3 times(double factor, double x, double y, double z) {
    return Tendon.Vec3.newBuilder().setX(factor * x).setY(factor * y).setZ(factor * z).build();
  }

  private void send(byte[] datagram) throws IOException {
    if (datagram == null) return;
    try {
      channel.write(ByteBuffer.wrap(datagram));
    } catch (PortUnreachableException nobodyThere) {
      // Treated as a lost datagram.
    }
  }

  private byte[] receive() throws IOException {
    ByteBuffer buffer = ByteBuffer.allocate(2048); // detects datagrams longer than 1200 bytes
    try {
      return channel.read(buffer) > 0 ? Arrays.copyOf(buffer.array(), buffer.position()) : null;
    } catch (PortUnreachableException nobodyThere) {
      return null;
    }
  }

  private static byte[] readKey(Path file) throws IOException {
    Set<PosixFilePermission> others = EnumSet.allOf(PosixFilePermission.class);
    others.removeAll(
        EnumSet.of(PosixFilePermission.OWNER_READ, PosixFilePermission.OWNER_WRITE, PosixFilePermission.OWNER_EXECUTE));
    others.retainAll(Files.getPosixFilePermissions(file));
    if (!others.isEmpty()) throw new IOException(file + ": others may read it");
    for (String line : Files.readAllLines(file)) {
      if (line.isBlank() || line.startsWith("#")) continue;
      String[] words = line.trim().split("\\s+");
      if (words.length == 2 && words[0].equals("controller")) return HexFormat.of().parseHex(words[1]);
    }
    throw new IOException(file + ": not the key file of a controller");
  }
}
