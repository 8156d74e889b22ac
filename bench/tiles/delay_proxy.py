#!/usr/bin/python3
"""A TCP proxy that adds a journey: every byte arrives so much later, and as many of them a second as before.

usage: delay_proxy.py TO_PORT DELAY_MS     prints the port that it listens on; ends with its standard input
"""
import asyncio
import sys
import threading
import os


async def carry(reader, writer, delay_s):
    loop = asyncio.get_running_loop()
    queue = asyncio.Queue()

    async def deliver():
        while True:
            due, data = await queue.get()
            await asyncio.sleep(max(0.0, due - loop.time()))
            if data is None:
                break
            writer.write(data)
            await writer.drain()
        writer.close()

    task = asyncio.create_task(deliver())
    try:
        while data := await reader.read(1 << 18):
            queue.put_nowait((loop.time() + delay_s, data))
    except ConnectionError:
        pass
    queue.put_nowait((loop.time() + delay_s, None))
    try:
        await task
    except ConnectionError:
        pass


async def main():
    to_port, delay_ms = int(sys.argv[1]), float(sys.argv[2])

    async def connected(reader, writer):
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", to_port)
        except ConnectionError:
            writer.close()
            return
        await asyncio.gather(carry(reader, far_writer, delay_ms / 2000), carry(far_reader, writer, delay_ms / 2000))

    server = await asyncio.start_server(connected, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
asyncio.run(main())
