# SPDX-License-Identifier: BSD-3-Clause
"""What a console's page does, without a browser: a WebSocket (RFC 6455), the board, commands."""
import base64
import json
import os
import select
import socket
import struct
import time


class Page:
    def __init__(self, port, origin=None, path="/live"):
        self.sections, self.answers, self.next_id, self.buffer = {}, {}, 1, b""
        self.hello = {}
        self.kept_at = 0.0
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=10)
        key = base64.b64encode(os.urandom(16)).decode()
        origin = origin or f"http://localhost:{port}"
        self.socket.sendall((f"GET {path} HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\nOrigin: {origin}\r\n\r\n").encode())
        while b"\r\n\r\n" not in self.buffer:
            more = self.socket.recv(4096)
            if not more:
                raise ConnectionError("closed before it was opened")
            self.buffer += more
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        if b" 101 " not in head.split(b"\r\n", 1)[0]:
            raise ConnectionError(head.split(b"\r\n", 1)[0].decode())

    def close(self):
        self.socket.close()

    def send_text(self, text):
        data, mask = text.encode(), os.urandom(4)
        size = len(data)
        head = struct.pack("!BB", 0x81, 0x80 | size) if size < 126 else struct.pack("!BBH", 0x81, 0xFE, size)
        self.socket.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))

    def frame(self):
        """The next message as text; None when there is none yet."""
        if len(self.buffer) < 2:
            return None
        size, at = self.buffer[1] & 0x7F, 2
        if size >= 126:
            width = 2 if size == 126 else 8
            if len(self.buffer) < 2 + width:
                return None
            size, at = int.from_bytes(self.buffer[2:2 + width], "big"), 2 + width
        if len(self.buffer) < at + size:
            return None
        kind, data = self.buffer[0] & 0x0F, self.buffer[at:at + size]
        self.buffer = self.buffer[at + size:]
        if kind == 8:
            raise ConnectionError("closed: " + data[2:].decode(errors="replace"))
        return data.decode() if kind == 1 else ""

    def take(self, message):
        if message["type"] == "hello":
            self.hello = message
        elif message["type"] == "answer":
            self.answers[message["id"]] = message
        elif message["type"] == "board":
            for name in message.get("reset", []):
                self.sections[name] = []
            self.sections.update(message.get("set", {}))
            for name, entries in message.get("add", {}).items():
                self.sections.setdefault(name, []).extend(entries)

    def listen(self, seconds=0.05):
        """Takes in what comes; keeps control where it has it."""
        end = time.monotonic() + seconds
        while True:
            self.keep_control()
            text = self.frame()
            if text:
                self.take(json.loads(text))
            elif text is None:
                left = end - time.monotonic()
                if left <= 0:
                    return
                if select.select([self.socket], [], [], min(left, 0.1))[0]:
                    more = self.socket.recv(1 << 16)
                    if not more:
                        raise ConnectionError("closed")
                    self.buffer += more

    def keep_control(self):
        if self.mine() and time.monotonic() - self.kept_at > 0.5:
            self.kept_at = time.monotonic()
            self.send("keep_control", {}, "")

    def get(self, name):
        return self.sections.get(name) or {}

    def mine(self):
        return bool(self.hello) and self.get("control").get("viewer") == self.hello["viewer"]

    def until(self, condition, seconds, what):
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(f"not within {seconds} s: {what}; {self.get('safe')} {self.get('procedure').get('reason')}")
            self.listen()

    def send(self, name, arguments, confirm):
        self.next_id += 1
        self.send_text(json.dumps({"type": "command", "id": self.next_id, "command": name, "arguments": arguments,
                                   "confirm": confirm}))
        return self.next_id

    def request(self, name, confirm="", **arguments):
        number = self.send(name, arguments, confirm)
        self.until(lambda: number in self.answers, 10, f"an answer to {name}")
        return self.answers.pop(number)

    def request_and_confirm(self, name, **arguments):
        """Sends the command and then its confirmation, as a person who answers yes."""
        first = self.request(name, **arguments)
        assert not first["accepted"] and first["confirm"], f"{name} needed no confirmation: {first}"
        second = self.request(name, first["confirm"], **arguments)
        assert second["accepted"], f"{name}: {second}"
        return first
