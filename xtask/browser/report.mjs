// Uses the page of `cargo xtask reference-comparison` as a reader would: node report.mjs FOLDER
// FOLDER holds index.html and the results.json it was made from. Needs playwright-core in a folder that NODE_PATH
// names, and a Chromium: the variable CHROMIUM, or one that PATH finds. `cargo xtask check --browser` has all that.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { findChromium } from "./chromium.mjs";

// An import statement would not look into NODE_PATH; require does.
const { chromium } = createRequire(import.meta.url)("playwright-core");

const folder = resolve(process.argv[2]);
const address = pathToFileURL(join(folder, "index.html")).href;
const results = JSON.parse(readFileSync(join(folder, "results.json"), "utf8"));

const browser = await chromium.launch({ executablePath: findChromium() });

/** Opens the page, and fails on whatever it complains of or fetches. */
async function open(options) {
  const context = await browser.newContext(options);
  const page = await context.newPage();
  const trouble = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && trouble.push(message.text()));
  page.on("pageerror", (error) => trouble.push(String(error)));
  page.on("request", (request) => {
    const url = request.url();
    if (url !== address && !url.startsWith("data:")) trouble.push(`it fetches ${url}`);
  });
  await page.goto(address);
  return { page, done: async () => { await context.close(); assert.deepEqual(trouble, []); } };
}

const drawable = (point) => point.seconds > 0 && point.error > 0;

/** Every chart shows all its data, and its words stand apart and within it. */
async function charts(page) {
  const seen = await page.$$eval(".plot", (plots) => plots.map((plot) => {
    const shown = [...plot.querySelectorAll("svg")].filter((svg) => svg.getBoundingClientRect().width > 0);
    const svg = shown[0];
    const box = svg.getBoundingClientRect();
    const words = [...svg.querySelectorAll("text")].map((text) => [text.textContent.trim(), text.getBoundingClientRect()]);
    const outside = words.filter(([, b]) => b.left < box.left || b.right > box.right || b.top < box.top || b.bottom > box.bottom);
    const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
    const overlaps = words.flatMap(([name, a], i) => words.slice(i + 1).filter(([, b]) => !apart(a, b)).map(([other]) => [name, other]));
    const letters = words.map(([, b]) => b.height);
    const curves = [...svg.querySelectorAll(".curve")].map((curve) => ({
      points: curve.querySelectorAll(".point").length,
      lines: curve.querySelectorAll(".line polyline").length,
    }));
    return {
      name: plot.dataset.chart, count: shown.length, width: box.width, height: box.height, curves, overlaps,
      outside: outside.map(([name]) => name), smallest: Math.min(...letters), label: svg.getAttribute("aria-label"),
    };
  }));
  for (const chart of seen) {
    assert.equal(chart.count, 1, `${chart.name}: one form of it is shown`);
    assert(chart.width > 250 && chart.height > 250, `${chart.name} is ${chart.width} × ${chart.height}`);
    assert.deepEqual(chart.overlaps, [], `${chart.name}: words overlap`);
    assert.deepEqual(chart.outside, [], `${chart.name}: words are cut off`);
    assert(chart.smallest > 10, `${chart.name}: letters of ${chart.smallest} pixels`);
  }
  results.scenes.forEach((scene, i) => {
    assert(seen[i].label.startsWith(scene.name), `${seen[i].label} is no chart of ${scene.name}`);
    const expected = scene.curves.map((curve) => {
      const points = curve.points.filter(drawable).length;
      return { points, lines: points > 1 ? 1 : 0 };
    });
    assert.deepEqual(seen[i].curves, expected, `${scene.name}: curves and points`);
  });
  assert.equal(seen.length, results.scenes.length + 2 * results.scaling.length, "a sweep has seconds and memory");
}

/** The stage: wipe, flicker, error maps, choice. */
async function stage(page) {
  const viewers = await page.$$(".viewer");
  assert.equal(viewers.length, results.scenes.length);
  const viewer = viewers[0];
  await viewer.scrollIntoViewIfNeeded();
  const part = (selector) => viewer.$(selector);
  const left = await part(".side.left");
  const handle = await part(".handle");
  const clip = () => left.evaluate((side) => getComputedStyle(side).clipPath);
  const at = () => handle.getAttribute("aria-valuenow").then(Number);
  // What is really on the screen, not what the style says: the share of the stage's middle row that is the left side.
  const shown = () => viewer.$eval(".stage", (stage) => {
    stage.querySelector(".handle").style.pointerEvents = "none";
    const box = stage.getBoundingClientRect();
    const y = box.top + 0.3 * box.height;
    const hits = Array.from({ length: 100 }, (_, i) => document.elementFromPoint(box.left + ((i + 0.5) * box.width) / 100, y));
    stage.querySelector(".handle").style.pointerEvents = "";
    return hits.filter((hit) => hit?.closest(".side.left")).length;
  });
  const near = (a, b, what) => assert(Math.abs(a - b) <= 2, `${what}: ${a}, not ${b}`);

  near(await shown(), 50, "half of the left picture at first");
  const box = await (await part(".stage")).boundingBox();
  const middle = box.y + box.height / 2;
  const before = await clip();
  await page.mouse.move(box.x + box.width / 2, middle);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.4, middle, { steps: 4 });
  await page.mouse.move(box.x + box.width * 0.25, middle, { steps: 4 });
  await page.mouse.up();
  assert.notEqual(await clip(), before, "dragging moves the clip");
  near(await at(), 25, "dragged to a quarter");
  await page.mouse.move(box.x + box.width * 0.9, middle);
  near(await at(), 25, "let go, it stays");
  await handle.focus();
  await page.keyboard.press("ArrowRight");
  near(await at(), 27, "an arrow key");
  await page.keyboard.press("End");
  assert.equal(await at(), 100);
  assert.match(await clip(), /inset\(0px (calc\(0%\)|0%|0px|calc\(100% - 100%\))/, "all of the left picture");
  await page.keyboard.press("Home");
  assert.equal(await at(), 0);

  const hidden = () => left.evaluate((side) => getComputedStyle(side).visibility);
  await (await part("[data-mode=flicker]")).click();
  const seen = new Set();
  for (let i = 0; i < 20; i++) {
    seen.add(await hidden());
    await page.waitForTimeout(100);
  }
  assert.deepEqual([...seen].sort(), ["hidden", "visible"], "flicker shows one, then the other");
  await (await part("button[data-mode=wipe]")).click();
  await page.waitForTimeout(700);
  assert.equal(await hidden(), "visible", "and stops");

  const source = () => left.$eval("img", (image) => image.src);
  const picture = await source();
  await (await part(".maps")).check();
  const map = await source();
  assert.notEqual(map, picture);
  assert(await page.$$eval(".shot img.errors", (images, map) => images.some((i) => i.src === map), map), "it is an error map");
  assert((await page.$$(".scale .ticks span")).length >= 3, "with a scale");
  await (await part(".maps")).uncheck();
  const shot = (await page.$$("section .shot button")).at(2);
  await shot.click();
  assert.equal(await source(), await shot.$eval("img.shown", (image) => image.src), "a click puts a picture on the left");

  const broken = await page.$$eval(".shot img, .stage img", (images) => images.filter((i) => !i.naturalWidth).length);
  assert.equal(broken, 0, "every picture decodes");
}

/** Nothing is wider than the window, but for what scrolls by itself. */
async function fits(page, width) {
  const wide = await page.evaluate((width) => {
    const out = [...document.body.querySelectorAll("*")].filter((element) => {
      return element.getBoundingClientRect().right > width + 0.5 && !element.closest(".scroll, .formula, svg");
    });
    return [document.documentElement.scrollWidth, ...out.map((e) => `${e.tagName}.${e.className}`)];
  }, width);
  assert.deepEqual(wide, [width], "nothing overflows sideways");
}

async function paper(page) {
  await page.emulateMedia({ media: "print" });
  const sides = await page.$$eval(".stage .side", (sides) => sides.map((side) => {
    const { visibility, clipPath } = getComputedStyle(side);
    return { visibility, clipPath, width: Math.round(side.getBoundingClientRect().width) };
  }));
  assert.equal(sides.length, 2 * results.scenes.length);
  for (const side of sides) assert.deepEqual(side, { ...sides[0], visibility: "visible", clipPath: "none" });
  assert.equal(await page.$eval(".plot", (plot) => getComputedStyle(plot).breakInside), "avoid");
  const pdf = await page.pdf({ format: "A4" });
  assert(pdf.subarray(0, 5).toString() === "%PDF-" && pdf.length > 50_000, "it can be printed");
}

const checks = [
  ["a page on a desk", { viewport: { width: 1280, height: 900 } }, async (page) => {
    assert.equal(await page.$$eval("script", (scripts) => scripts.length), 1);
    assert.equal(await page.$$eval("main b", (all) => all.filter((b) => b.textContent === "bold").length), 0, "names are no markup");
    await charts(page);
    await fits(page, 1280);
    await stage(page);
    await paper(page);
  }],
  ["a phone, dark", { viewport: { width: 390, height: 844 }, isMobile: true, hasTouch: true, colorScheme: "dark" }, async (page) => {
    await charts(page);
    await page.$$eval("details", (all) => all.forEach((details) => (details.open = true)));
    await fits(page, 390);
    const colours = await page.evaluate(() => [
      getComputedStyle(document.body).backgroundColor,
      getComputedStyle(document.querySelector("svg.narrow .panel rect")).fill,
    ]);
    for (const colour of colours) assert(Number(colour.match(/\d+/)[0]) < 60, `dark is dark: ${colour}`);
  }],
  ["without its script", { viewport: { width: 1280, height: 900 }, javaScriptEnabled: false }, async (page) => {
    assert(await page.$(".shot img"), "the pictures are there all the same");
  }],
];
try {
  for (const [name, options, check] of checks) {
    const { page, done } = await open(options);
    await check(page);
    await done();
    console.log(`${name}: as it should be`);
  }
} finally {
  await browser.close();
}
