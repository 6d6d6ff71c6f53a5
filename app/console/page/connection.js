// SPDX-License-Identifier: BSD-3-Clause
// The WebSocket to the server: connects again by itself, and pairs commands with their answers.

const patience = [250, 500, 1000, 2000];  // ms before the next attempt
const staleAfter = 2500;                  // ms without a message
const answerWithin = 8000;                // ms

export class Connection {
  /// handlers: {hello, board, state}; `state(name)` is called with connecting, open, stale or lost.
  constructor(handlers) {
    this.handlers = handlers;
    this.state = 'connecting';
    this.attempts = 0;
    this.heardAt = performance.now();
    this.everHeard = false;
    this.nextId = 1;
    this.waiting = new Map();
    this.open();
    setInterval(() => this.watch(), 250);
  }

  open() {
    // Next to the page, which a proxy may serve at a path of its own.
    const live = new URL('live' + location.search, location.href);
    live.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    this.openedAt = performance.now();
    this.socket = new WebSocket(live.href);
    this.socket.onmessage = (event) => this.receive(event.data);
    this.socket.onclose = () => this.closed();
  }

  receive(text) {
    const message = JSON.parse(text);
    this.heardAt = performance.now();
    this.everHeard = true;
    if (message.type === 'answer') return this.answered(message);
    if (message.type === 'hello') {
      this.attempts = 0;
      this.handlers.hello(message);
    } else if (message.type === 'board') {
      this.handlers.board(message);
    }
    this.become('open');
  }

  become(state) {
    if (state === this.state) return;
    this.state = state;
    this.handlers.state(state);
  }

  closed() {
    for (const {resolve} of this.waiting.values())
      resolve(
          {accepted: false, text: 'the connection was lost before an answer came', confirm: ''});
    this.waiting.clear();
    this.become(this.everHeard ? 'lost' : 'connecting');
    const wait = patience[Math.min(this.attempts++, patience.length - 1)];
    setTimeout(() => this.open(), wait);
  }

  watch() {
    const silent = this.silentFor();
    const isOpen = this.socket.readyState === WebSocket.OPEN;
    if (isOpen && this.everHeard && silent > staleAfter) this.become('stale');
    // A peer that went without notice: begin anew rather than wait for TCP to notice.
    if (silent > 20000 && performance.now() - this.openedAt > 20000 &&
        this.socket.readyState <= WebSocket.OPEN)
      this.socket.close();
    for (const [id, {resolve, sentAt}] of this.waiting) {
      if (performance.now() - sentAt < answerWithin) continue;
      this.waiting.delete(id);
      resolve({accepted: false, text: 'no answer', confirm: ''});
    }
  }

  silentFor() {
    return performance.now() - this.heardAt;
  }

  /// Resolves to the server's answer, never rejects.
  command(name, parameters = {}, confirm = '') {
    if (this.socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve({accepted: false, text: 'not connected', confirm: ''});
    }
    const id = this.nextId++;
    this.socket.send(
        JSON.stringify({type: 'command', id, command: name, arguments: parameters, confirm}));
    return new Promise((resolve) => this.waiting.set(id, {resolve, sentAt: performance.now()}));
  }

  answered(message) {
    const waiting = this.waiting.get(message.id);
    if (!waiting) return;
    this.waiting.delete(message.id);
    waiting.resolve(message);
  }
}
