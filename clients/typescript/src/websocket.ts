// SPDX-License-Identifier: Apache-2.0
import type { OpenTransport } from "./connect.js";

/** Older datagrams would not be useful. */
const kMaxWaitingBytes = 16 * 1024;

/**
 * A transport for browsers, which cannot use UDP. Each binary message contains one datagram, and the WebSocket bridge
 * forwards it unchanged. If there is a key, the bridge only sees encrypted datagrams. After the WebSocket is closed,
 * the next datagram opens a new one, and a session of suite 1 is continued.
 *
 *     webSocket("ws://127.0.0.1:47180")
 */
export function webSocket(url: string | URL, WebSocketClass: typeof WebSocket = WebSocket): OpenTransport {
  return (receive) => {
    let socket: WebSocket | undefined;
    /** The newest datagram that was sent before the socket was open. */
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
