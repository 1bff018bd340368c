// SPDX-License-Identifier: Apache-2.0
import type { OpenTransport } from "./connect.js";

/** A WebSocket is a queue; what waits in it longer than this is older than a hand can use. */
const kMaxWaitingBytes = 16 * 1024;

/**
 * The way of a browser, which has no UDP: one binary message is one datagram, and tendon-bridge passes it on as it is. With
 * a key the bridge sees sealed datagrams only. When the WebSocket has closed, the next datagram opens another; a session of
 * suite 1 goes on over it.
 *
 *     webSocket("ws://127.0.0.1:47180")
 */
export function webSocket(url: string | URL, WebSocketClass: typeof WebSocket = WebSocket): OpenTransport {
  return (receive) => {
    let socket: WebSocket | undefined;
    /** The newest datagram that came while the socket was opening. */
    let waiting: Uint8Array | undefined;
    let closed = false;

    const open = (): WebSocket => {
      const opening = new WebSocketClass(url);
      opening.binaryType = "arraybuffer";
      opening.onmessage = ({ data }) => {
        if (!closed && data instanceof ArrayBuffer) receive(new Uint8Array(data));
      };
      opening.onopen = () => {
        if (closed) opening.close();
        else if (waiting) opening.send(waiting);
        waiting = undefined;
      };
      opening.onerror = () => {}; // "close" follows
      opening.onclose = () => {
        if (socket === opening) socket = undefined;
      };
      return opening;
    };

    return {
      send(datagram) {
        socket ??= open();
        if (socket.readyState === WebSocketClass.CONNECTING) waiting = datagram;
        else if (socket.readyState === WebSocketClass.OPEN && socket.bufferedAmount < kMaxWaitingBytes) {
          socket.send(datagram);
        }
      },
      close() {
        closed = true;
        if (socket?.readyState === WebSocketClass.OPEN) socket.close(1000);
      },
    };
  };
}
