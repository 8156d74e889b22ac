#!/usr/bin/python3
"""A web server that misbehaves on request, for tests of transfers.

range_server.py FOLDER serves FOLDER/data.bin at every path, on a free loopback port that it prints, until its standard input
closes. The first folder of a path says how, in comma-separated words; each path counts its requests for itself:

  skip=N            the first N requests are served well
  status=S[xN]      N answers (or all) of that status     retry=S | retrydate=S    with Retry-After
  delay=MS          before each answer                    reset=B[xN]   the connection is reset after B bytes of the body
  shift=B[xN]       ranges are off by B bytes             drip[xN]      ten bytes a second
  short[xN]         the body ends early, cleanly          huge          a whole file of 1 TiB for any range
  noranges          the whole file for any range          chunked       ... without a length
  weak | noetag | nodate      what the version is known by
  change            another version, after `skip`         deaf          If-Match is ignored
  to=HOST:PORT      redirects there, to a path without it; https=1 to https

Anything else is a bucket of S3: signatures are checked where there is one. Every request is a line of FOLDER/log,
its fields parted by tabs.
"""
import email.utils
import hashlib
import hmac
import http.server
import os
import re
import socket
import struct
import sys
import threading
import time
import urllib.parse

folder = sys.argv[1]
data = open(os.path.join(folder, "data.bin"), "rb").read()
other_data = bytes(255 - b for b in data)
secret = "wJalrXUtnFEMI/K7MDENG+bPxRfiCYEXAMPLEKEY"
lock = threading.Lock()
counts = {}
in_flight = 0
log = open(os.path.join(folder, "log"), "a", buffering=1)


def expected_signature(handler, scope, signed_headers):
    """Of AWS signature version 4, from the request as it arrived: AWS General Reference, "Create a signed AWS API request"."""
    day, region, service, _ = scope.split("/")
    path, _, query = handler.path.partition("?")
    headers = "".join(f"{name}:{' '.join(handler.headers[name].split())}\n" for name in signed_headers.split(";"))
    payload = handler.headers.get("x-amz-content-sha256", hashlib.sha256(b"").hexdigest())
    canonical = "\n".join([handler.command, path, query, headers, signed_headers, payload])
    to_sign = "\n".join(["AWS4-HMAC-SHA256", handler.headers["X-Amz-Date"], scope, hashlib.sha256(canonical.encode()).hexdigest()])
    key = ("AWS4" + secret).encode()
    for part in (day, region, service, "aws4_request"):
        key = hmac.new(key, part.encode(), hashlib.sha256).digest()
    return hmac.new(key, to_sign.encode(), hashlib.sha256).hexdigest()


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        global in_flight
        with lock:
            counts[self.path] = nth = counts.get(self.path, 0) + 1
            in_flight += 1
            now = in_flight
        signature = self.signature()
        fields = {"path": self.path, "host": self.headers.get("Host"), "range": self.headers.get("Range"),
                  "if-match": self.headers.get("If-Match"), "if-none-match": self.headers.get("If-None-Match"),
                  "authorization": self.headers.get("Authorization"), "agent": self.headers.get("User-Agent"),
                  "token": self.headers.get("x-amz-security-token"), "payload": self.headers.get("x-amz-content-sha256"),
                  "signature": signature, "in-flight": now, "peer": self.client_address[1]}
        with lock:
            log.write("\t".join(f"{name}={value}" for name, value in fields.items() if value is not None) + "\n")
        try:
            self.answer(nth, signature)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True
        finally:
            with lock:
                in_flight -= 1

    def do_POST(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.reply(200, [("Content-Type", "application/json")], b'{"method": "POST", "got": "' + body + b'"}')

    def signature(self):
        match = re.match(r"AWS4-HMAC-SHA256 Credential=[^/]+/([^,]+), ?SignedHeaders=([^,]+), ?Signature=(\w+)",
                         self.headers.get("Authorization", ""))
        if not match:
            return None
        scope, signed, given = match.groups()
        return "good" if expected_signature(self, scope, signed) == given else "bad"

    def words(self):
        first = urllib.parse.unquote(self.path.split("?")[0]).split("/")[1]
        result = {}
        for word in first.split(","):
            name, _, value = word.partition("=")
            value, _, times = value.partition("x") if value else (value, "", "")
            if not value and re.search(r"x\d+$", name):
                name, times = name.rsplit("x", 1)
            result[name] = (value, int(times) if times else 1 << 30)
        return result

    def reply(self, status, headers, body=b""):
        self.send_response(status)
        for name, value in headers:
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def answer(self, nth, signature):
        words = self.words()
        nth -= int(words.get("skip", ("0", 0))[0])
        active = lambda name: name in words and 1 <= nth <= words[name][1]
        value = lambda name: words[name][0]
        if signature == "bad":
            return self.reply(403, [("Content-Type", "application/xml")], b"<Error><Code>SignatureDoesNotMatch</Code></Error>")
        if active("delay"):
            time.sleep(int(value("delay")) / 1000)
        if active("to"):
            scheme = "https" if "https" in words else "http"
            return self.reply(302, [("Location", f"{scheme}://{value('to')}/arrived/data.bin")], b"elsewhere")
        if active("status"):
            headers = []
            if "retry" in words:
                headers.append(("Retry-After", value("retry")))
            if "retrydate" in words:
                headers.append(("Retry-After", email.utils.formatdate(time.time() + int(value("retrydate")), usegmt=True)))
            if value("status") == "301":
                headers.append(("x-amz-bucket-region", "eu-west-1"))
            return self.reply(int(value("status")), headers, b'{"error": "as asked"}')

        changed = active("change")
        content = other_data if changed else data
        tag = '"v2"' if changed else '"v1"'
        headers = []
        if "noetag" not in words:
            headers.append(("ETag", "W/" + tag if "weak" in words else tag))
        if "nodate" not in words:
            headers.append(("Last-Modified", "Sun, 02 Aug 2026 10:00:00 GMT" if changed else "Sat, 01 Aug 2026 10:00:00 GMT"))
        if self.headers.get("If-Match", tag) != tag and "deaf" not in words:
            return self.reply(412, [])
        if "noetag" not in words and self.headers.get("If-None-Match", "").removeprefix("W/") == tag:
            self.send_response(304)
            for name, text in headers:
                self.send_header(name, text)
            self.end_headers()
            return

        match = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
        if not match or active("noranges") or active("huge"):
            return self.send_whole(headers, content, words)
        first, last = int(match[1]), min(int(match[2]), len(content) - 1)
        if first >= len(content):
            return self.reply(416, headers + [("Content-Range", f"bytes */{len(content)}")])
        if active("shift"):
            first, last = first + int(value("shift")), last + int(value("shift"))
        self.send_response(206)
        for name, text in headers:
            self.send_header(name, text)
        self.send_header("Content-Range", f"bytes {first}-{last}/{len(content)}")
        body = content[first:last + 1]
        if active("short"):
            body = body[:len(body) // 2]
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if active("reset"):
            self.wfile.write(body[:int(value("reset"))])
            self.wfile.flush()
            time.sleep(0.1)  # a reset discards what has not been read
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.close_connection = True
            self.connection.close()
        elif active("drip"):
            for i in range(len(body)):
                self.wfile.write(body[i:i + 1])
                self.wfile.flush()
                time.sleep(0.1)
        else:
            self.wfile.write(body)

    def send_whole(self, headers, content, words):
        self.send_response(200)
        for name, text in headers:
            self.send_header(name, text)
        if "huge" in words:
            self.send_header("Content-Length", str(1 << 40))
            self.end_headers()
            sent = 0
            try:
                while sent < 1 << 30:
                    self.wfile.write(bytes(1 << 16))
                    sent += 1 << 16
            finally:
                with lock:
                    log.write(f"huge-sent={sent}\n")
        elif "chunked" in words:
            self.send_header("Transfer-Encoding", "chunked")
            self.end_headers()
            for start in range(0, len(content), 100000):
                chunk = content[start:start + 100000]
                self.wfile.write(b"%x\r\n" % len(chunk) + chunk + b"\r\n")
            self.wfile.write(b"0\r\n\r\n")
        else:
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 64

    def handle_error(self, *_):
        pass


server = Server(("127.0.0.1", 0), Handler)
print(server.server_address[1], flush=True)
threading.Thread(target=server.serve_forever, daemon=True).start()
sys.stdin.read()
