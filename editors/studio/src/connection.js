// The one socket to the server: messages of the language server and of the studio, and word when it is gone.
export function connection(ended) {
  const address = new URL("socket", location.href);
  address.protocol = "ws:";
  const socket = new WebSocket(address);
  const handlers = new Set();
  socket.addEventListener("message", ({ data }) => handlers.forEach((handler) => handler(data)));
  socket.addEventListener("close", ended);
  return {
    opened: new Promise((resolve, reject) => {
      socket.addEventListener("open", resolve, { once: true });
      socket.addEventListener("close", reject, { once: true });
    }),
    transport: {
      send(message) {
        if (socket.readyState !== WebSocket.OPEN) throw new Error("the studio has ended");
        socket.send(message);
      },
      subscribe: (handler) => handlers.add(handler),
      unsubscribe: (handler) => handlers.delete(handler),
    },
  };
}
