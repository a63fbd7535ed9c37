// `npm ci && node show.mjs FILE LAYOUT OUT.png`: a recording with a layout in the viewer, as a picture. Exit 1 where the viewer
// reports a problem. CHROMIUM names the browser.

import { createReadStream, existsSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join } from "node:path";

import puppeteer from "puppeteer-core";

const [file, layout, picture] = process.argv.slice(2);
const HERE = import.meta.dirname;
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".json": "application/json", ".wasm": "application/wasm" };
const OWN = { "/": join(HERE, "index.html"), "/layout.json": layout, "/test.mcap": file };
const TIMEOUT = 300_000; // ms, for a busy machine
const SETTLE = 30_000; // ms, until all panels are drawn

function pathOf(url) {
  const modules = join(HERE, "node_modules");
  return OWN[url] ?? join(modules, url.startsWith("/react") ? "" : "@foxglove/studio-base", url);
}

const server = createServer((request, response) => {
  const path = pathOf(request.url);
  if (!existsSync(path)) {
    response.writeHead(404).end();
    return;
  }
  const { size } = statSync(path);
  const head = { "content-type": TYPES[extname(path)] ?? "application/octet-stream", "accept-ranges": "bytes" };
  const range = /bytes=(\d+)-(\d*)/.exec(request.headers.range ?? "");
  const start = Number(range?.[1] ?? 0);
  const end = Math.min(Number(range?.[2] || size), size - 1);
  const more = range ? { "content-range": `bytes ${start}-${end}/${size}` } : {};
  response.writeHead(range ? 206 : 200, { ...head, ...more, "content-length": end - start + 1 });
  createReadStream(path, { start, end }).pipe(response);
}).listen(0, "127.0.0.1");

const executablePath = process.env.CHROMIUM ?? "/usr/bin/chromium";
const browser = await puppeteer.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu"] });
try {
  const page = await browser.newPage();
  await page.setViewport({ width: 1700, height: 1200 });
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction(() => document.body.innerText.includes("rths.Event @"), { timeout: TIMEOUT });
  await new Promise((done) => setTimeout(done, SETTLE));
  await page.screenshot({ path: picture });
  await page.evaluate(() => [...document.querySelectorAll("button")].find((item) => item.innerText.startsWith("Problems")).click());
  await page.waitForFunction(() => /No problems found/.test(document.body.innerText), { timeout: 10_000 });
  console.log(`${picture}: no problem reported`);
} finally {
  await browser.close();
  server.close();
}
