// Shows baked scenes as a web page would: node baked.mjs FOLDER NAME...
// For each NAME, FOLDER/NAME.glb is loaded by three.js and shown from its first camera into FOLDER/NAME.png, as large
// as the picture FOLDER/NAME.expected.png where there is one; prints the mean absolute difference of the two, in
// 8-bit sRGB values. Needs three and playwright-core in the node_modules folder that NODE_PATH names, and a Chromium:
// the variable CHROMIUM, or one that PATH finds. `cargo xtask check --browser` has all that.
import assert from "node:assert/strict";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { delimiter, extname, join, resolve, sep } from "node:path";
import { findChromium } from "./chromium.mjs";

const { chromium } = createRequire(import.meta.url)("playwright-core");

const folder = resolve(process.argv[2]);
const names = process.argv.slice(3);
const modules = process.env.NODE_PATH.split(delimiter).map((m) => resolve(m)).find((m) => existsSync(join(m, "three")));
assert(modules, "no npm package three in NODE_PATH");

const page = `<!doctype html>
<link rel="icon" href="data:,">
<style>body { margin: 0 }</style>
<script type="importmap">{ "imports": { "three": "/modules/three/build/three.module.js" } }</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "/modules/three/examples/jsm/loaders/GLTFLoader.js";

window.show = async (name, width, height) => {
  const gltf = await new GLTFLoader().loadAsync("/files/" + name + ".glb");
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  renderer.toneMapping = THREE.NoToneMapping;
  renderer.outputColorSpace = THREE.SRGBColorSpace;
  renderer.setSize(width, height);
  const camera = gltf.cameras[0];
  if (camera.isPerspectiveCamera) camera.aspect = width / height;
  camera.updateProjectionMatrix();
  gltf.scene.updateMatrixWorld(true);
  renderer.render(gltf.scene, camera);
  const url = renderer.domElement.toDataURL("image/png");
  let triangles = renderer.info.render.triangles;
  renderer.dispose();
  return { url, triangles };
};

window.difference = async (one, other) => {
  const pixels = async (url) => {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height).data;
  };
  const [a, b] = [await pixels(one), await pixels(other)];
  if (a.length !== b.length) throw new Error("the pictures differ in size");
  let sum = 0;
  for (let i = 0; i < a.length; i++) if (i % 4 < 3) sum += Math.abs(a[i] - b[i]);
  return sum / (a.length / 4 * 3);
};
</script>`;

const kinds = { ".js": "text/javascript", ".glb": "model/gltf-binary" };
const server = createServer((request, response) => {
  const url = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  if (url === "/") return response.writeHead(200, { "content-type": "text/html" }).end(page);
  const root = url.startsWith("/modules/") ? modules : folder;
  const path = resolve(root, url.split("/").slice(2).join("/"));
  if (!path.startsWith(root + sep) || !existsSync(path)) return response.writeHead(404).end();
  response.writeHead(200, { "content-type": kinds[extname(path)] ?? "application/octet-stream" }).end(readFileSync(path));
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));

// The software rasteriser, for machines without a GPU; slow, and the same everywhere.
const args = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const browser = await chromium.launch({ executablePath: findChromium(), args });
try {
  const tab = await browser.newPage();
  const trouble = [];
  tab.on("console", (message) => message.type() === "error" && trouble.push(message.text()));
  tab.on("pageerror", (error) => trouble.push(String(error)));
  await tab.goto(`http://127.0.0.1:${server.address().port}/`);
  await tab.waitForFunction(() => window.show);
  for (const name of names) {
    const expected = join(folder, `${name}.expected.png`);
    const bytes = existsSync(expected) ? readFileSync(expected) : null;
    // Width and height stand at 16 and 20 of a PNG.
    const [width, height] = bytes ? [bytes.readUInt32BE(16), bytes.readUInt32BE(20)] : [640, 480];
    const { url, triangles } = await tab.evaluate(([n, w, h]) => window.show(n, w, h), [name, width, height]);
    writeFileSync(join(folder, `${name}.png`), Buffer.from(url.split(",")[1], "base64"));
    assert.deepEqual(trouble, []);
    const line = { name, triangles };
    if (bytes) {
      const other = `data:image/png;base64,${bytes.toString("base64")}`;
      line.difference = await tab.evaluate(([a, b]) => window.difference(a, b), [url, other]);
    }
    console.log(JSON.stringify(line));
  }
} finally {
  await browser.close();
  server.close();
}
